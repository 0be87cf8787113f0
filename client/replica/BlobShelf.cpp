#include "client/replica/BlobShelf.h"

namespace tessera {

void BlobShelf::put(Blob blob) {
    const BlobId id = blob.id();
    if (!blob.resident() || held_.contains(id)) return;
    heldBytes_ += blob.sizeBytes();
    byAge_.push_back(id);
    held_.emplace(id, store_.add(std::move(blob)));
}

void BlobShelf::trim(const std::function<void(const BlobId&)>& dropped) {
    if (heldBytes_ <= budgetBytes_) return;
    std::deque<BlobId> staying;
    for (const BlobId& id : byAge_) {
        const auto it = held_.find(id);
        // One holder: the shelf itself. Another one may come from the store at any time; then the bytes simply live on.
        if (heldBytes_ > budgetBytes_ && it->second.soleHandle()) {
            heldBytes_ -= it->second.sizeBytes();
            held_.erase(it);
            dropped(id);
        } else {
            staying.push_back(id);
        }
    }
    byAge_ = std::move(staying);
}

void BlobShelf::forEach(const std::function<void(const Blob&)>& visit) const {
    for (const BlobId& id : byAge_) visit(held_.at(id));
}

}  // namespace tessera
