#include "common/session/SwapBarrier.h"

#include <algorithm>

namespace tessera {

namespace {
/// Odd, so that the median is one of them. Half a second of a wall at 60 Hz.
constexpr std::size_t kRecentFrames = 31;
/// What a host that holds the others up again and again has to prove doubles up to this: 18 minutes at 60 Hz. After as
/// many frames in which it was waited for it is as one that never did.
constexpr std::uint32_t kMostToProve = 65'536;
}  // namespace

SwapBarrier::SwapBarrier(SyncPolicy policy, FrameNumber first) : policy_(policy), next_(first) {}

void SwapBarrier::enter(const std::string& host) {
    const auto [it, fresh] = members_.try_emplace(host);
    Member& member = it->second;
    if (member.dropped) member = Member{.proving = member.proving, .waitedFor = member.waitedFor};
    const auto heldUp = fresh ? heldUp_.find(host) : heldUp_.end();
    for (std::uint32_t times = heldUp == heldUp_.end() ? 0 : heldUp->second; times > 0 && member.proving < kMostToProve;
         --times)
        member.proving = std::max(1u, 2 * member.proving);
}

void SwapBarrier::heldUpBy(const std::string& host, const Member& member) {
    if (member.proving == 0) ++heldUp_[host];  // else nobody has waited for it
}

void SwapBarrier::leave(const std::string& host) {
    const auto it = members_.find(host);
    if (it == members_.end()) return;
    if (it->second.progress == Progress::kDrawing) lastHost_ = host;
    members_.erase(it);
}

bool SwapBarrier::mayBegin() const {
    if (open_ || (!members_.empty() && count(Progress::kBehind) == members_.size())) return false;
    return std::ranges::none_of(members_, [](const auto& item) { return item.second.toShow && item.second.holdsUp; });
}

std::vector<std::string> SwapBarrier::begin(FrameNumber frame, TimePoint now) {
    TESSERA_CHECK(!open_, "a frame begins while another one is open");
    TESSERA_CHECK(frame == next_, "frames begin one after the other");
    open_ = true;
    next_ = next_.next();
    begun_ = now;
    lastHost_.clear();
    std::vector<std::string> drawing;
    for (auto& [name, member] : members_) {
        if (member.progress == Progress::kBehind) continue;
        member.progress = Progress::kDrawing;
        member.everBegun = true;
        member.frame = frame;
        member.begunAt = now;
        drawing.push_back(name);
    }
    return drawing;
}

Expected<void> SwapBarrier::ready(const std::string& host, FrameNumber frame, TimePoint now) {
    const auto it = members_.find(host);
    if (it == members_.end())
        return fail(ErrorCode::kRefused, "host '" + host + "' says ready for frame " + std::to_string(frame.value) +
                                             " but is not in the barrier");
    Member& member = it->second;
    if (!member.everBegun || frame > member.frame)
        return fail(ErrorCode::kRefused, "host '" + host + "' says ready for frame " + std::to_string(frame.value) +
                                             ", which it was not told to draw");
    if (frame < member.frame) return {};
    if (member.progress == Progress::kDrawing) {
        member.progress = Progress::kDone;
        member.readyAt = now;
        lastHost_ = host;
    } else if (member.progress == Progress::kBehind) {
        if (member.proving > 0) --member.proving;
        if (member.dropped)
            members_.erase(it);
        else
            member.progress = Progress::kIdle;
    }
    return {};
}

void SwapBarrier::told(TimePoint now) {
    for (auto& [name, member] : members_)
        if (member.toShow && !member.toShowSince) member.toShowSince = now;
}

bool SwapBarrier::untold() const {
    return std::ranges::any_of(members_,
                               [](const auto& item) { return item.second.toShow && !item.second.toShowSince; });
}

void SwapBarrier::shown(const std::string& host, FrameNumber frame, TimePoint now) {
    const auto it = members_.find(host);
    if (it == members_.end() || !it->second.toShow) return;
    Member& member = it->second;
    if (frame < *member.toShow) {
        member.toShowSince = now;  // an earlier one: it comes forward
        return;
    }
    member.toShow.reset();
    if (member.proving > 0)
        --member.proving;
    else if (!heldUp_.empty() && ++member.waitedFor >= kMostToProve)
        heldUp_.erase(host);
}

SwapBarrier::Outcome SwapBarrier::poll(TimePoint now, TimePoint known) {
    Outcome outcome;
    removeUnshown(known, outcome);
    if (policy_.lateFrame != LateFramePolicy::kWait) waitNoLongerForShown(known);
    removeStalled(known, outcome);
    if (!open_) return outcome;
    leaveLateBehind(known, outcome);
    if (count(Progress::kDrawing) == 0) release(now, outcome);
    return outcome;
}

void SwapBarrier::waitNoLongerForShown(TimePoint now) {
    for (auto& [name, member] : members_)
        if (owesFor(member, shownPatience(), now)) member.holdsUp = false;
}

void SwapBarrier::removeUnshown(TimePoint now, Outcome& outcome) {
    for (auto it = members_.begin(); it != members_.end();) {
        if (!owesFor(it->second, policy_.lostAfter, now)) {
            ++it;
            continue;
        }
        if (it->second.progress == Progress::kDrawing) lastHost_ = it->first;
        heldUpBy(it->first, it->second);
        outcome.unshown.push_back(it->first);
        it = members_.erase(it);
    }
}

void SwapBarrier::removeStalled(TimePoint now, Outcome& outcome) {
    const Duration deadline = frameDeadline();
    for (auto it = members_.begin(); it != members_.end();) {
        const Member& member = it->second;
        const bool draws = member.progress == Progress::kDrawing || member.progress == Progress::kBehind;
        if (draws && now >= member.begunAt + deadline) {
            if (member.progress == Progress::kDrawing) lastHost_ = it->first;
            heldUpBy(it->first, member);
            (member.toShow ? outcome.unshown : outcome.stalled).push_back(it->first);
            it = members_.erase(it);
        } else {
            ++it;
        }
    }
}

bool SwapBarrier::mayLeaveBehind() const {
    if (count(Progress::kDone) == 0 || count(Progress::kDrawing) == 0) return false;
    return policy_.lateFrame != LateFramePolicy::kWait || std::ranges::none_of(members_, [](const auto& item) {
               return item.second.progress == Progress::kDrawing && item.second.proving == 0;
           });
}

void SwapBarrier::leaveLateBehind(TimePoint now, Outcome& outcome) {
    if (!mayLeaveBehind() || now < firstReady() + policy_.lateAfter) return;
    for (auto& [name, member] : members_) {
        if (member.progress != Progress::kDrawing) continue;
        member.progress = Progress::kBehind;
        member.dropped = policy_.lateFrame == LateFramePolicy::kDrop;
        lastHost_ = name;
        if (member.dropped) outcome.held.push_back(name);
    }
}

void SwapBarrier::release(TimePoint now, Outcome& outcome) {
    outcome.released = true;
    outcome.frame = openFrame();
    outcome.frameTime = std::max(Duration::zero(), now - begun_);
    outcome.lastHost = lastHost_;
    outcome.wait = waitForLast(now);
    if (count(Progress::kDone) > 0) {
        outcome.barrierTime = std::max(Duration::zero(), now - firstReady());
        if (recentFrames_.size() == kRecentFrames) recentFrames_.erase(recentFrames_.begin());
        recentFrames_.push_back(outcome.frameTime);
    }
    for (auto& [name, member] : members_) {
        if (member.progress == Progress::kDone) {
            member.progress = Progress::kIdle;
            if (!member.toShow) member.toShowSince.reset();
            member.toShow = outcome.frame;
            member.holdsUp = member.proving == 0;
            outcome.show.push_back(name);
        } else if (member.progress == Progress::kBehind && !member.dropped) {
            outcome.held.push_back(name);
        }
    }
    open_ = false;
}

SwapBarrier::Wait SwapBarrier::waitForLast(TimePoint now) const {
    const auto drawn = [&](const auto& item) { return item.second.progress == Progress::kDone; };
    const auto last = members_.find(lastHost_);
    Wait wait{.drew = last != members_.end() && drawn(*last)};
    const Member* before = nullptr;
    for (const auto& item : members_) {
        if (!drawn(item) || item.first == lastHost_ || (before && before->readyAt >= item.second.readyAt)) continue;
        before = &item.second;
        wait.before = item.first;
    }
    if (!before) return wait;
    const TimePoint until = wait.drew ? last->second.readyAt : now;
    wait.took = std::max(Duration::zero(), until - begun_);
    wait.beforeTook = std::clamp(before->readyAt - begun_, Duration::zero(), wait.took);
    wait.alone = wait.took - wait.beforeTook;
    return wait;
}

TimePoint SwapBarrier::nextDeadline() const {
    const bool waiting = count(Progress::kDrawing) > 0;
    if (open_ && !waiting) return begun_;
    TimePoint next = TimePoint::max();
    const Duration deadline = frameDeadline();
    for (const auto& [name, member] : members_) {
        if (member.progress == Progress::kDrawing || member.progress == Progress::kBehind)
            next = std::min(next, member.begunAt + deadline);
        if (!member.toShow) continue;
        if (!member.toShowSince) return begun_;  // at once: see `told`
        next = std::min(next, *member.toShowSince + policy_.lostAfter);
        if (member.holdsUp && policy_.lateFrame != LateFramePolicy::kWait)
            next = std::min(next, *member.toShowSince + shownPatience());
    }
    if (open_ && mayLeaveBehind()) next = std::min(next, firstReady() + policy_.lateAfter);
    return next;
}

std::vector<std::string> SwapBarrier::waitingFor() const {
    std::vector<std::string> names;
    for (const auto& [name, member] : members_)
        if (member.progress == Progress::kDrawing) names.push_back(name);
    return names;
}

bool SwapBarrier::contains(const std::string& host) const {
    const auto it = members_.find(host);
    return it != members_.end() && !it->second.dropped;
}

std::uint32_t SwapBarrier::framesToProve(const std::string& host) const {
    const auto it = members_.find(host);
    return it == members_.end() ? 0 : it->second.proving;
}

Duration SwapBarrier::frameDeadline() const {
    if (recentFrames_.empty()) return std::max(policy_.frameDeadline, policy_.firstFrameDeadline);
    std::vector<Duration> sorted = recentFrames_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return std::max<Duration>(policy_.frameDeadline, 3 * *middle);
}

std::size_t SwapBarrier::count(Progress progress) const {
    return static_cast<std::size_t>(std::count_if(members_.begin(), members_.end(),
                                                  [&](const auto& item) { return item.second.progress == progress; }));
}

TimePoint SwapBarrier::firstReady() const {
    TimePoint first = TimePoint::max();
    for (const auto& [name, member] : members_)
        if (member.progress == Progress::kDone) first = std::min(first, member.readyAt);
    return first;
}

}  // namespace tessera
