#include "server/sim/records/WaitingLists.h"

#include <utility>

#include "common/change/LikeSizes.h"
#include "server/sim/commit/EditHistory.h"

namespace tessera {

namespace {
/// Changes. More would take a frame's time; and of so much at once little is set twice.
constexpr std::size_t kMostMerged = 32'768;
}  // namespace

void WaitingLists::add(const CommittedFrame& frame, Merge merge) {
    lists_.push_back({.sequence = frame.sent->sequence, .list = frame.list, .bytes = memoryOf(*frame.list)});
    bytes_ += lists_.back().bytes;
    if (merge == Merge::kYes) mergeNewest();
}

void WaitingLists::mergeNewest() {
    mergeLikeSizes(lists_, kMostMerged, [this](const Waiting& older, const Waiting& newer, ChangeListPtr list) {
        Waiting both{.sequence = newer.sequence, .list = std::move(list)};
        both.bytes = memoryOf(*both.list);
        bytes_ = bytes_ + both.bytes - older.bytes - newer.bytes;
        return both;
    });
}

}  // namespace tessera
