#include "common/base/BlobMaker.h"

#include <algorithm>
#include <cstring>

namespace tessera {

namespace {

/// Pages of this process.
class OwnPages : public BlobPlace {
public:
    explicit OwnPages(std::size_t size) : pages_(size) {}
    bool write(std::size_t offset, ByteSpan bytes) override { return pages_.write(offset, bytes); }
    void read(std::size_t offset, std::span<std::byte> to) const override { pages_.read(offset, to); }
    std::shared_ptr<const PagedBytes> finish() override { return pages_.finish(); }

private:
    PagedBytes::Maker pages_;
};

}  // namespace

BlobMaker::BlobMaker(std::uint64_t sizeBytes, std::unique_ptr<BlobPlace> place) : sizeBytes_(sizeBytes) {
    if (sizeBytes < Blob::kPagedBytes) return;
    place_ = place ? std::move(place) : std::make_unique<OwnPages>(static_cast<std::size_t>(sizeBytes));
}

void BlobMaker::write(std::uint64_t offset, ByteSpan bytes) {
    constexpr std::size_t kFirstRoom = std::size_t{1} << 20;
    TESSERA_CHECK(offset <= sizeBytes_ && bytes.size() <= sizeBytes_ - offset, "no more comes than was announced");
    const auto at = static_cast<std::size_t>(offset);
    if (place_ && !place_->write(at, bytes)) moveToHeap();
    if (!place_) {
        const std::size_t end = at + bytes.size();
        // Once its first MiB is there addresses are taken for all of it.
        if (end > bytes_.capacity())
            bytes_.reserve(static_cast<std::size_t>(end <= kFirstRoom ? std::min<std::uint64_t>(sizeBytes_, kFirstRoom)
                                                                      : sizeBytes_));
        if (end > bytes_.size()) bytes_.resize(end);
        if (!bytes.empty()) std::memcpy(bytes_.data() + at, bytes.data(), bytes.size());
    }
    end_ = std::max<std::uint64_t>(end_, offset + bytes.size());
    if (sizeBytes_ <= kBlobLeafBytes || bytes.empty()) return;
    for (std::size_t leaf = at / kBlobLeafBytes; leaf * kBlobLeafBytes < at + bytes.size(); ++leaf) {
        const std::size_t from = leaf * kBlobLeafBytes, size = bytesOf(leaf);
        if (from >= at && from + size <= at + bytes.size())
            hash(leaf, bytes.subspan(from - at, size));
        else if (leaf < known_.size())
            known_[leaf] = false;
    }
}

void BlobMaker::hash(std::size_t leaf, ByteSpan bytes) {
    if (leaf >= leaves_.size()) {
        leaves_.resize(leaf + 1);
        known_.resize(leaf + 1);
    }
    leaves_[leaf] = hash128(bytes);
    known_[leaf] = true;
}

std::size_t BlobMaker::bytesOf(std::size_t leaf) const {
    return static_cast<std::size_t>(std::min<std::uint64_t>(kBlobLeafBytes, sizeBytes_ - leaf * kBlobLeafBytes));
}

void BlobMaker::read(std::size_t offset, std::span<std::byte> to) const {
    if (place_)
        place_->read(offset, to);
    else if (!to.empty())
        std::memcpy(to.data(), bytes_.data() + offset, to.size());
}

void BlobMaker::moveToHeap() {
    bytes_.resize(static_cast<std::size_t>(end_));
    place_->read(0, bytes_);
    place_.reset();
}

Blob BlobMaker::whole(std::uint64_t sizeBytes, std::unique_ptr<BlobPlace> place) {
    TESSERA_CHECK(sizeBytes >= Blob::kPagedBytes && place, "what lies in a place is large");
    BlobMaker maker(sizeBytes, std::move(place));
    maker.end_ = sizeBytes;
    return maker.finish();
}

Blob BlobMaker::finish() {
    TESSERA_CHECK(end_ == sizeBytes_, "a blob is whole");
    Blob::Content content;
    content.sizeBytes = sizeBytes_;
    content.resident = true;
    if (sizeBytes_ > kBlobLeafBytes) {
        Bytes room(kBlobLeafBytes);
        for (std::size_t leaf = 0; leaf * kBlobLeafBytes < sizeBytes_; ++leaf) {
            if (leaf < known_.size() && known_[leaf]) continue;
            const std::span<std::byte> bytes = std::span(room).first(bytesOf(leaf));
            read(leaf * kBlobLeafBytes, bytes);
            hash(leaf, bytes);
        }
        content.id = blobIdOf(sizeBytes_, leaves_);
        content.leaves = std::move(leaves_);
    } else {
        content.id = hash128(bytes_);
    }
    if (place_) content.paged = place_->finish();
    if (place_ && !content.paged) moveToHeap();
    if (!content.paged) content.bytes = std::move(bytes_);
    return Blob(std::make_shared<const Blob::Content>(std::move(content)));
}

}  // namespace tessera
