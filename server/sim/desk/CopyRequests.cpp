#include "server/sim/desk/CopyRequests.h"

#include <algorithm>
#include <utility>

#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {
constexpr std::size_t kCopiedAtOnce = 1024;  ///< changes
}  // namespace

ServerActions CopyRequests::ask(const Asker& asker, const CloneWish& wish, TimePoint now) {
    const std::size_t most = limits_.maxProposalChanges;
    CloneOptions options{.under = wish.under,
                         .name = wish.name,
                         .deep = wish.deep,
                         .shareTypes = wish.shareTypes,
                         .shareObjects = wish.shareObjects,
                         .maxChanges = around_.orderCopy ? std::min(kCopiedAtOnce, most) : most};
    Expected<Clone> clone = cloneList(around_.simulation.scene(), wish.node, options);
    if (!clone && clone.error().code == ErrorCode::kLimit && options.maxChanges < most) {
        const std::uint64_t ticket = edits_.newTicket();
        options.maxChanges = most;
        edits_.open(ticket, {.asker = asker, .isCopy = true});
        waiting_.push_back({.ticket = ticket, .node = wish.node, .copy = std::move(options)});
        goOn();
        return {};
    }
    if (!clone) return around_.answers().to(asker, tl::unexpected(clone.error()));
    std::vector<Blob> named = blobsOf(clone->list);
    const std::size_t bytes = memoryWithoutArrays(clone->list);
    return edits_.enter({.asker = asker,
                         .edit = {.list = std::move(clone->list)},
                         .created = clone->objects,
                         .copy = clone->node,
                         .bytes = bytes},
                        std::move(named), now);
}

void CopyRequests::goOn() {
    while (!waiting_.empty() && !edits_.find(waiting_.front().ticket)) waiting_.pop_front();
    if (making_ || waiting_.empty() || edits_.copiedBytes() >= limits_.maxOpenBytes) return;
    making_ = true;
    around_.orderCopy(std::move(waiting_.front()));
    waiting_.pop_front();
}

ServerActions CopyRequests::copied(Preparation made, TimePoint now) {
    making_ = false;
    ServerActions actions;
    if (OpenEdits::Open* const open = edits_.find(made.ticket); !open) {
        edits_.drop(std::move(made.lists));
    } else if (made.refused) {
        actions = edits_.refuse(made.ticket, *made.refused);
    } else {
        open->copy = made.top;
        open->created = open->edit.objects = made.objects;
        open->bytes = made.bytes;
        open->parts = std::move(made.lists);
        actions = edits_.queue(made.ticket, std::move(made.arrays), now);
    }
    goOn();
    return actions;
}

}  // namespace tessera
