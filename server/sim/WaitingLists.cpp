#include "server/sim/WaitingLists.h"

#include <array>
#include <utility>

#include "server/sim/commit/EditHistory.h"

namespace tessera {

namespace {
constexpr std::size_t kMostMerged = 32'768;  ///< changes
}  // namespace

void WaitingLists::add(const CommittedFrame& frame, Merge merge) {
    lists_.push_back({.sequence = frame.sent->sequence, .list = frame.list, .bytes = memoryOf(*frame.list)});
    bytes_ += lists_.back().bytes;
    if (merge == Merge::kYes) mergeNewest();
}

void WaitingLists::mergeNewest() {
    while (lists_.size() > 1) {
        const Waiting& older = lists_[lists_.size() - 2];
        const Waiting& newer = lists_.back();
        if (older.list->changeCount() > 2 * newer.list->changeCount()) return;
        // More would take a frame's time; and of so much at once little is set twice.
        if (older.list->changeCount() + newer.list->changeCount() > kMostMerged) return;
        // Two where an id that was destroyed comes back: they stay apart.
        std::vector<ChangeList> merged = compact(std::array{older.list, newer.list});
        if (merged.size() > 1) return;
        Waiting both{.sequence = newer.sequence,
                     .list = std::make_shared<const ChangeList>(merged.empty() ? ChangeList() : std::move(merged.front()))};
        both.bytes = memoryOf(*both.list);
        bytes_ = bytes_ + both.bytes - older.bytes - newer.bytes;
        lists_.pop_back();
        lists_.back() = std::move(both);
    }
}

}  // namespace tessera
