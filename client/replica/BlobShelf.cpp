#include "client/replica/BlobShelf.h"

#include <algorithm>

namespace tessera {
namespace {

constexpr std::size_t kLooksPerTrim = 64;

}  // namespace

void BlobShelf::put(Blob blob) {
    const BlobId id = blob.id();
    if (!blob.resident() || held_.contains(id)) return;
    heldBytes_ += blob.sizeBytes();
    inTurn_.push_back(id);
    held_.emplace(id, store_.add(std::move(blob)));
}

void BlobShelf::trim(const std::function<void(const BlobId&)>& dropped) {
    if (heldBytes_ <= budgetBytes_) return;
    std::size_t looks = std::min(kLooksPerTrim, inTurn_.size());
    for (; looks > 0 && heldBytes_ > budgetBytes_; --looks) {
        const BlobId id = inTurn_.front();
        inTurn_.pop_front();
        const auto it = held_.find(id);
        // One holder: the shelf itself. Another one may come from the store at any time; then the bytes simply live on.
        if (!it->second.soleHandle()) {
            inTurn_.push_back(id);
            continue;
        }
        heldBytes_ -= it->second.sizeBytes();
        held_.erase(it);
        dropped(id);
    }
}

void BlobShelf::forEach(const std::function<void(const Blob&)>& visit) const {
    for (const BlobId& id : inTurn_) visit(held_.at(id));
}

}  // namespace tessera
