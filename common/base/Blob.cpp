#include "common/base/Blob.h"

#include <algorithm>
#include <string>

namespace tessera {

namespace {

std::vector<Hash128> leavesOf(ByteSpan bytes) {
    std::vector<Hash128> leaves;
    if (bytes.size() <= kBlobLeafBytes) return leaves;
    leaves.reserve(bytes.size() / kBlobLeafBytes + 1);
    for (std::size_t at = 0; at < bytes.size(); at += kBlobLeafBytes)
        leaves.push_back(hash128(bytes.subspan(at, std::min(kBlobLeafBytes, bytes.size() - at))));
    return leaves;
}

/// The size goes in: a blob that happens to hold the hashes of another's leaves is not that other.
BlobId idFrom(ByteSpan bytes, const std::vector<Hash128>& leaves) {
    if (leaves.empty()) return hash128(bytes);
    std::vector<Hash128> all = leaves;
    all.push_back({bytes.size(), kBlobLeafBytes});
    return hash128(std::as_bytes(std::span(all)));
}

}  // namespace

BlobId blobIdOf(ByteSpan bytes) {
    return idFrom(bytes, leavesOf(bytes));
}

Blob::Blob(Bytes bytes) : Blob(std::make_shared<const Content>(contentOf(std::move(bytes)))) {}

Blob::Blob(std::shared_ptr<const void> owner, ByteSpan bytes)
    : Blob(std::make_shared<const Content>(contentOf(ByteSlice(std::move(owner), bytes)))) {}

Blob::Content Blob::contentOf(ByteSlice bytes) {
    Content content;
    content.sizeBytes = bytes.size();
    content.resident = true;
    content.leaves = leavesOf(bytes);
    content.id = idFrom(bytes, content.leaves);
    content.bytes = std::move(bytes);
    return content;
}

Blob Blob::movedTo(std::shared_ptr<const void> owner, ByteSpan sameBytes) const {
    TESSERA_CHECK(resident() && sameBytes.size() == sizeBytes(), "a blob that moves takes its bytes along");
    auto content = std::make_shared<Content>(*content_);
    content->bytes = ByteSlice(std::move(owner), sameBytes);
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

Expected<Blob> Blob::withRange(std::uint64_t offset, ByteSpan bytes) const {
    if (!resident()) return fail(ErrorCode::kRefused, "the array is not here");
    if (bytes.empty() || offset > sizeBytes() || bytes.size() > sizeBytes() - offset)
        return fail(ErrorCode::kBadInput, "the range [" + std::to_string(offset) + ", +" + std::to_string(bytes.size()) +
                                              ") does not lie in an array of " + std::to_string(sizeBytes()) + " bytes");
    auto content = std::make_shared<Content>(*content_);
    Bytes changed(this->bytes().begin(), this->bytes().end());
    std::memcpy(changed.data() + offset, bytes.data(), bytes.size());
    content->bytes = std::move(changed);
    const ByteSpan all = content->bytes;
    if (!content->leaves.empty())
        for (std::size_t leaf = offset / kBlobLeafBytes; leaf * kBlobLeafBytes < offset + bytes.size(); ++leaf) {
            const std::size_t at = leaf * kBlobLeafBytes;
            content->leaves[leaf] = hash128(all.subspan(at, std::min(kBlobLeafBytes, all.size() - at)));
        }
    content->id = idFrom(all, content->leaves);
    content->origins.assign(1, {id(), offset, offset + bytes.size()});
    for (const Origin& earlier : content_->origins) {
        if (content->origins.size() == kOrigins) break;
        content->origins.push_back({earlier.id, std::min<std::uint64_t>(earlier.begin, offset),
                                    std::max<std::uint64_t>(earlier.end, offset + bytes.size())});
    }
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

Blob Blob::absent(BlobId id, std::uint64_t sizeBytes) {
    if (!id) return {};
    auto content = std::make_shared<Content>();
    content->id = id;
    content->sizeBytes = sizeBytes;
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

Blob BlobStore::add(Blob blob) {
    if (!blob.resident()) return blob;
    const std::scoped_lock lock(mutex_);
    auto& entry = known_[blob.id()];
    if (auto existing = entry.lock()) return Blob(std::move(existing));
    entry = blob.content_;
    if (known_.size() > sweepAt_) {
        std::erase_if(known_, [](const auto& item) { return item.second.expired(); });
        sweepAt_ = 2 * known_.size() + 1024;
    }
    return blob;
}

Blob BlobStore::find(const BlobId& id) const {
    const std::scoped_lock lock(mutex_);
    const auto it = known_.find(id);
    if (it == known_.end()) return {};
    auto content = it->second.lock();
    return content ? Blob(std::move(content)) : Blob();
}

}  // namespace tessera
