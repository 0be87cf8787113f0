#include "tests/support/wall/MoveTally.h"

#include <fmt/format.h>

#include <cmath>

#include "common/cores/Transform.h"

namespace tessera::simulation {

MoveTally::MoveTally(SimulatedApplication& application) {
    const Expected<ObjectId> node = findNode(application.scene(), "/tally");
    if (!node) throw Violation("no tally: " + node.error().message);
    node_ = *node;
    core_ = application.scene().get<Node>(node_)->core;
}

void MoveTally::look(const SimulatedApplication& application, bool whole) {
    const auto* core = application.scene().get<Transform>(core_);
    if (!core) throw Violation("what nobody touches is gone: the tally");
    readings_.push_back({application.sequence(), core->translation.x(), whole});
}

void MoveTally::answered(const std::string& application, std::uint64_t request,
                         const Expected<ApplicationAnswer>& answer) {
    const auto asked = asked_.find({application, request});
    if (asked == asked_.end()) return;
    // The journal has ended: the edit stands, and its author is told that it may be lost.
    if (!answer && answer.error().message.starts_with("it is done")) {
        if (asked->second == Asked::kMove)
            ++unknown_;
        else
            stepUnknown_ = true;
    }
    if (const auto* committed = answer ? std::get_if<answer::Committed>(&*answer) : nullptr) {
        if (asked->second == Asked::kStep)
            steps_.insert(committed->sequence);
        else
            ++granted_[committed->sequence];
    }
    asked_.erase(asked);
}

void MoveTally::forgetQuestionsOf(const std::string& application) {
    std::erase_if(asked_, [&](const auto& entry) {
        if (!application.empty() && entry.first.first != application) return false;
        if (entry.second == Asked::kMove)
            ++unknown_;
        else
            stepUnknown_ = true;
        return true;
    });
}

std::string MoveTally::fault() {
    std::string fault;
    for (std::size_t i = 1; i < readings_.size() && fault.empty(); ++i) {
        const TallyReading &before = readings_[i - 1], &now = readings_[i];
        int granted = 0;
        for (auto at = granted_.upper_bound(before.sequence); at != granted_.end() && at->first <= now.sequence; ++at)
            granted += at->second;
        const auto step = steps_.upper_bound(before.sequence);
        if (stepUnknown_ || (step != steps_.end() && *step <= now.sequence)) continue;
        const double more = now.at - before.at - granted;
        if (more < 0 || more > unknown_ || more != std::floor(more))
            fault = fmt::format(
                "relative moves: {} were granted in lists {} to {}, {} are not known of, and the node moved by {}",
                granted, before.sequence.value + 1, now.sequence.value, unknown_, now.at - before.at);
    }
    if (!readings_.empty()) {
        const TallyReading last = readings_.back();
        std::erase_if(granted_, [&](const auto& entry) { return entry.first <= last.sequence; });
        std::erase_if(steps_, [&](Sequence each) { return each <= last.sequence; });
        readings_ = {last};
    }
    unknown_ = 0;
    stepUnknown_ = false;
    return fault;
}

}  // namespace tessera::simulation
