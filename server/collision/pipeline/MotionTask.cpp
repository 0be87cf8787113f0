#include "server/collision/pipeline/MotionTask.h"

#include <algorithm>

#include "common/base/Workers.h"
#include "server/collision/pipeline/PairQueries.h"

namespace tessera {
namespace {

/// Tests that a motion may take for certain when it is tried with others; most take a hundredth of it.
constexpr std::uint64_t kLeastShare = 100'000;

}  // namespace

MotionTask::MotionTask(const ObjectHandler& handler, const Mover& mover, std::vector<Obstruction> obstructions)
    : mover_(mover), obstructions_(std::move(obstructions)) {
    handler.forPartsCarried(mover.number, [&](std::uint32_t part, std::uint32_t) { carried_.push_back(part); });
    for (const Obstruction& o : obstructions_)
        stateOf_.emplace(std::uint64_t{o.parts.partA} << 32 | o.parts.partB, o.state);
}

std::uint64_t MotionTask::touchingAtStart(const MotionTools& tools, std::uint32_t a, std::uint32_t b) {
    const Part &partA = tools.handler.parts()[a], &partB = tools.handler.parts()[b];
    if (!partA.worldBox.overlaps(partB.worldBox)) return 0;
    const std::uint32_t k = stateOf_.at(std::uint64_t{a} << 32 | b);
    PairState& state = tools.memory.states()[k];
    if (!state.touch.holds(partA, partB, true)) {
        ++pairsTested_;
        before_.emplace_back(k, state);
    }
    const bool touched = state.touch.touching;
    askTouch(state, partA, partB, true, tools.limits.maxContacts, work_);
    if (state.touch.touching != touched) changed_.push_back(k);
    if (state.touch.complete) return state.touch.faceCount;
    // An undecided start is taken for contact; the response will not get far with it.
    leftOpen_.push_back(k);
    return std::max<std::uint64_t>(state.touch.faceCount, 1);
}

void MotionTask::run(const MotionTools& tools, std::uint64_t limit) {
    resolution_ = {};
    resolution_.accepted = mover_.way.end;
    work_ = {.limit = limit};
    if (obstructions_.empty()) return;
    std::vector<ObstaclePair> pairs;
    bool slides = false;
    for (const Obstruction& o : obstructions_) {
        pairs.push_back(o.parts);
        slides = slides || o.parts.slide;
    }
    trial_.emplace(
        tools.handler, mover_.wish.transform, mover_.way, pairs,
        [&](std::uint32_t a, std::uint32_t b) { return touchingAtStart(tools, a, b); }, tools.limits.stopTolerance,
        work_, pairsTested_);
    resolution_ = (slides ? tools.slide : tools.stop).resolve(*trial_);
}

void MotionTask::takeBack(PairMemory& memory) {
    // A pair that was asked twice was known the second time.
    for (auto& [k, state] : before_) memory.states()[k] = std::move(state);
    before_.clear();
    leftOpen_.clear();
    changed_.clear();
    trial_.reset();
    pairsTested_ = 0;
}

std::size_t MotionRuns::independent(std::span<const MotionTask> tasks) {
    ++run_;
    movedIn_.resize(tools_.handler.parts().size(), 0);
    const auto moved = [&](std::uint32_t part) { return movedIn_[part] == run_; };
    const std::size_t most = std::max<std::uint64_t>(1, left() / kLeastShare);
    for (std::size_t i = 0; i < std::min(most, tasks.size()); ++i) {
        const MotionTask& task = tasks[i];
        if (std::ranges::any_of(task.carried(), moved) ||
            std::ranges::any_of(task.obstructions(), [&](const MotionTask::Obstruction& o) {
                return moved(o.parts.partA) || moved(o.parts.partB);
            }))
            return i;
        for (const std::uint32_t part : task.carried()) movedIn_[part] = run_;
    }
    return std::min(most, tasks.size());
}

std::uint64_t MotionRuns::tryAll(std::span<MotionTask> tasks) {
    const std::uint64_t share = left() / tasks.size();
    const auto tryOne = [&](std::size_t i) { tasks[i].run(tools_, share); };
    if (workers_ != nullptr && tasks.size() > 1) {
        workers_->run(tasks.size(), tryOne);
    } else {
        for (std::size_t i = 0; i < tasks.size(); ++i) tryOne(i);
    }
    return share;
}

void MotionRuns::tryAgain(MotionTask& task, std::uint64_t share) {
    const std::uint64_t used = task.work().boxTests + task.work().triangleTests;
    if (share == left() || used < std::min(share, left())) return;
    task.takeBack(tools_.memory);
    task.run(tools_, left());
}

}  // namespace tessera
