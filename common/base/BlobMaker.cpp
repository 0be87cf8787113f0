#include "common/base/BlobMaker.h"

#include <algorithm>

namespace tessera {

void BlobMaker::append(ByteSpan bytes) {
    constexpr std::size_t kFirstRoom = std::size_t{1} << 20;
    TESSERA_CHECK(bytes.size() <= missing(), "no more comes than was announced");
    if (filled_ == 0 && sizeBytes_ >= Blob::kPagedBytes) pages_.emplace(sizeBytes_);
    filled_ += bytes.size();
    if (pages_ && pages_->append(bytes)) return;
    if (pages_) {
        bytes_.resize(pages_->filled());
        pages_->read(bytes_);
        pages_.reset();
    }
    // Once its first MiB is there addresses are taken for all of it.
    if (filled_ > bytes_.capacity()) bytes_.reserve(filled_ <= kFirstRoom ? std::min<std::size_t>(sizeBytes_, kFirstRoom) : sizeBytes_);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

Blob BlobMaker::finish() {
    TESSERA_CHECK(missing() == 0, "a blob is whole");
    return pages_ ? Blob(pages_->finish()) : Blob(std::move(bytes_));
}

}  // namespace tessera
