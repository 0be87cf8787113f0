#include "common/base/Blob.h"

#include <algorithm>
#include <string>
#include <utility>

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

BlobId idOf(ByteSpan bytes, const std::vector<Hash128>& leaves) {
    return leaves.empty() ? hash128(bytes) : blobIdOf(bytes.size(), leaves);
}

}  // namespace

/// The size goes in: a blob that happens to hold the hashes of another's leaves is not that other.
BlobId blobIdOf(std::uint64_t sizeBytes, const std::vector<Hash128>& leaves) {
    std::vector<Hash128> all;
    all.reserve(leaves.size() + 1);
    all = leaves;
    all.push_back({sizeBytes, kBlobLeafBytes});
    return hash128(std::as_bytes(std::span(all)));
}

BlobId blobIdOf(ByteSpan bytes) {
    return idOf(bytes, leavesOf(bytes));
}

Blob::Blob(Bytes bytes) : Blob(std::make_shared<const Content>(contentOf(std::move(bytes)))) {}

Blob::Blob(std::shared_ptr<const PagedBytes> bytes) {
    Content content;
    content.sizeBytes = bytes->sizeBytes();
    content.resident = true;
    Bytes room;  // leaf after leaf: nobody may ever ask for all of them in one piece
    for (std::size_t at = 0; at < content.sizeBytes; at += kBlobLeafBytes) {
        room.resize(std::min<std::size_t>(kBlobLeafBytes, content.sizeBytes - at));
        bytes->read(at, room);
        content.leaves.push_back(hash128(room));
    }
    content.id = content.leaves.size() == 1 ? content.leaves.front() : blobIdOf(content.sizeBytes, content.leaves);
    if (content.leaves.size() == 1) content.leaves.clear();
    content.paged = std::move(bytes);
    content_ = std::make_shared<const Content>(std::move(content));
}

Blob::Blob(std::shared_ptr<const void> owner, ByteSpan bytes, Place place) {
    Content content = contentOf(ByteSlice(owner, bytes));
    lay(content, std::move(owner), bytes, place);
    content_ = std::make_shared<const Content>(std::move(content));
}

void Blob::lay(Content& content, std::shared_ptr<const void> owner, ByteSpan bytes, Place place) {
    content.paged =
        place == Place::kSharedMapping && bytes.size() >= kPagedBytes ? PagedBytes::over(owner, bytes) : nullptr;
    content.bytes = content.paged ? ByteSlice() : ByteSlice(std::move(owner), bytes);
}

Blob::Content Blob::contentOf(ByteSlice bytes) {
    Content content;
    content.sizeBytes = bytes.size();
    content.resident = true;
    content.leaves = leavesOf(bytes);
    content.id = idOf(bytes, content.leaves);
    content.bytes = std::move(bytes);
    return content;
}

Blob Blob::movedTo(std::shared_ptr<const void> owner, ByteSpan sameBytes, Place place) const {
    TESSERA_CHECK(resident() && sameBytes.size() == sizeBytes(), "a blob that moves takes its bytes along");
    auto content = std::make_shared<Content>(*content_);
    lay(*content, std::move(owner), sameBytes, place);
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

Blob Blob::paged() const {
    if (!resident() || sizeBytes() < kPagedBytes || content_->paged) return *this;
    std::shared_ptr<const PagedBytes> paged = PagedBytes::copyOf(bytes());
    if (!paged) return *this;
    auto content = std::make_shared<Content>(*content_);
    content->paged = std::move(paged);
    content->bytes = {};
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

/// The bytes of `content`, which is a copy of ours but for them, and the hashes of its leaves.
void Blob::setRange(Content& content, std::uint64_t offset, ByteSpan bytes) const {
    content.bytes = {};
    content.paged = sizeBytes() >= kPagedBytes ? paged().content_->paged : nullptr;
    if (content.paged) content.paged = content.paged->withRange(offset, bytes);
    if (!content.paged) {  // small, or there is no such memory
        Bytes changed(this->bytes().begin(), this->bytes().end());
        std::memcpy(changed.data() + offset, bytes.data(), bytes.size());
        content.bytes = std::move(changed);
    }
    if (content.leaves.empty()) return;
    Bytes room;
    for (std::size_t leaf = offset / kBlobLeafBytes; leaf * kBlobLeafBytes < offset + bytes.size(); ++leaf) {
        const std::size_t at = leaf * kBlobLeafBytes, size = std::min<std::size_t>(kBlobLeafBytes, sizeBytes() - at);
        if (!content.paged) {
            content.leaves[leaf] = hash128(content.bytes.bytes().subspan(at, size));
            continue;
        }
        room.resize(size);
        content.paged->read(at, room);
        content.leaves[leaf] = hash128(room);
    }
}

Expected<Blob> Blob::withRange(std::uint64_t offset, ByteSpan bytes) const {
    if (!resident()) return fail(ErrorCode::kRefused, "the array is not here");
    if (bytes.empty() || offset > sizeBytes() || bytes.size() > sizeBytes() - offset)
        return fail(ErrorCode::kBadInput, "the range [" + std::to_string(offset) + ", +" +
                                              std::to_string(bytes.size()) + ") does not lie in an array of " +
                                              std::to_string(sizeBytes()) + " bytes");
    auto content = std::make_shared<Content>(*content_);
    setRange(*content, offset, bytes);
    content->id = content->leaves.empty() ? hash128(content->all()) : blobIdOf(sizeBytes(), content->leaves);
    content->origins.assign(1, {id(), offset, offset + bytes.size()});
    for (const Origin& earlier : content_->origins) {
        if (content->origins.size() == kOrigins) break;
        content->origins.push_back({earlier.id, std::min<std::uint64_t>(earlier.begin, offset),
                                    std::max<std::uint64_t>(earlier.end, offset + bytes.size())});
    }
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

void Blob::read(std::uint64_t offset, std::span<std::byte> to) const {
    TESSERA_CHECK(resident() && offset <= sizeBytes() && to.size() <= sizeBytes() - offset, "what is read lies inside");
    if (to.empty()) return;
    if (content_->paged)
        content_->paged->read(offset, to);
    else
        std::memcpy(to.data(), content_->bytes.data() + offset, to.size());
}

Blob Blob::absent(BlobId id, std::uint64_t sizeBytes) {
    if (!id) return {};
    auto content = std::make_shared<Content>();
    content->id = id;
    content->sizeBytes = sizeBytes;
    return Blob(std::shared_ptr<const Content>(std::move(content)));
}

/// Where in a store the next content of the same bytes lies. Somebody may hold that one alone, so each is known.
static BlobId nextTwin(const BlobId& id) {
    return hash128(std::as_bytes(std::span(&id, 1)));
}

Blob BlobStore::add(Blob blob) {
    if (!blob.resident()) return blob;
    const std::scoped_lock lock(mutex_);
    std::shared_ptr<const Blob::Content> first;
    BlobId at = blob.id();
    for (auto content = known_[at].lock(); content && content != blob.content_; content = known_[at].lock()) {
        if (!first) first = std::move(content);
        at = nextTwin(at);
    }
    known_[at] = blob.content_;
    if (known_.size() > sweepAt_) {
        for (const auto& [place, twin] : std::exchange(known_, {})) {
            const auto content = twin.lock();
            if (!content) continue;
            BlobId next = content->id;
            while (known_.contains(next)) next = nextTwin(next);
            known_[next] = content;
        }
        sweepAt_ = 2 * known_.size() + 1024;
    }
    return first ? Blob(std::move(first)) : blob;
}

Blob BlobStore::find(const BlobId& id) const {
    const std::scoped_lock lock(mutex_);
    for (auto it = known_.find(id); it != known_.end(); it = known_.find(nextTwin(it->first)))
        if (auto content = it->second.lock()) return Blob(std::move(content));
    return {};
}

}  // namespace tessera
