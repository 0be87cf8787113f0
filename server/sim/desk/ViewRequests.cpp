#include "server/sim/desk/ViewRequests.h"

#include <algorithm>

#include "server/sim/frame/Simulation.h"

namespace tessera {

ServerActions ViewRequests::ask(const Asker& asker, const ViewWish& wish) {
    waiting_.push_back({asker, wish, simulation_.sequence()});
    return goOn();
}

ServerActions ViewRequests::surveyed(const AnimatedBounds& bounds, Sequence at) {
    ordered_ = false;
    known_ = {at, bounds};
    return goOn();
}

ServerActions ViewRequests::goOn() {
    ServerActions actions;
    for (; !waiting_.empty(); waiting_.pop_front()) {
        const Waiting& next = waiting_.front();
        const bool needs = needsSurvey(next.wish);
        if (needs && (!known_ || known_->first < next.asked)) {
            if (!std::exchange(ordered_, true)) survey_();
            break;
        }
        append(actions, set(next.asker, next.wish, needs ? &known_->second : nullptr));
    }
    return actions;
}

ServerActions ViewRequests::set(const Asker& asker, const ViewWish& wish, const AnimatedBounds* bounds) {
    const Expected<void> set = view_.set(simulation_.scene(), wish, bounds);
    if (!set) return answers_.to(asker, tl::unexpected(set.error()));
    return answers_.to(asker, ApplicationAnswer(answer::Done{}));
}

void ViewRequests::applicationLeft(ConnectionId connection) {
    std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.asker.connection == connection; });
}

std::size_t ViewRequests::openCount(ConnectionId connection) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        waiting_, [&](const Waiting& waiting) { return waiting.asker.connection == connection; }));
}

}  // namespace tessera
