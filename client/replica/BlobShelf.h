/// Where a host's blobs lie between their arrival and their use, and between two connections.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <unordered_map>

#include "common/base/Blob.h"

namespace tessera {

/// Keeps blobs findable in a store although no scene names them yet, or any more. Above the budget, those that nobody
/// else holds go, those that have been looked at longest ago first. One thread.
class BlobShelf {
public:
    BlobShelf(BlobStore& store, std::uint64_t budgetBytes) : store_(store), budgetBytes_(budgetBytes) {}

    void put(Blob blob);
    /// Lets go of what is over the budget and used by nobody; `dropped` hears of each. Looks at a few blobs in turn:
    /// call it often, it costs the same however many are in use.
    void trim(const std::function<void(const BlobId&)>& dropped);
    void forEach(const std::function<void(const Blob&)>& visit) const;

    [[nodiscard]] std::uint64_t heldBytes() const { return heldBytes_; }

private:
    BlobStore& store_;
    std::uint64_t budgetBytes_;
    std::uint64_t heldBytes_ = 0;
    std::deque<BlobId> inTurn_;
    std::unordered_map<BlobId, Blob> held_;
};

}  // namespace tessera
