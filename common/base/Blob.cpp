#include "common/base/Blob.h"

namespace tessera {

Blob::Blob(Bytes bytes) : id_(hash128(bytes)), sizeBytes_(bytes.size()), bytes_(share(std::move(bytes))) {}

Blob Blob::absent(BlobId id, std::uint64_t sizeBytes) {
    Blob blob;
    blob.id_ = id;
    blob.sizeBytes_ = sizeBytes;
    return blob;
}

Blob BlobStore::add(Blob blob) {
    if (!blob.resident()) return blob;
    const std::scoped_lock lock(mutex_);
    auto& entry = known_[blob.id()];
    if (SharedBytes existing = entry.lock()) return Blob(blob.id(), std::move(existing));
    entry = blob.shared();
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
    SharedBytes bytes = it->second.lock();
    return bytes ? Blob(id, std::move(bytes)) : Blob();
}

}  // namespace tessera
