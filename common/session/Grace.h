/// A caller that stood still condemns nobody for a while: what peers said meanwhile may lie unread.
#pragma once

#include <algorithm>
#include <optional>

#include "common/base/Clock.h"
#include "common/base/SyncPolicy.h"

namespace tessera {

/// Follows when the caller looks at anything, and when it looks at the clock. Neither for longer than half of
/// `lostAfter`: the whole process stood still, or nobody is there. Then peers get a moment, a heartbeat long, in which
/// silence and deadlines are not judged.
///
/// Invariants: times never go back, whatever order events come in; no more than kInARow moments follow one another
/// directly. Pure; one owner.
class Grace {
public:
    /// A caller that is slow every time gets no more than this: then silence is judged with what is known.
    static constexpr int kInARow = 3;

    explicit Grace(const SyncPolicy& policy) : longest_(policy.lostAfter / 2), moment_(policy.heartbeat) {}

    /// First thing to be done with every time that comes in, of an event or of a look at the clock.
    void look(TimePoint now);
    /// After `look`, where it is a look at the clock: how long the caller has stood still, zero if it has not.
    [[nodiscard]] Duration stoodStill(TimePoint now);

    [[nodiscard]] bool lasts(TimePoint now) const { return now < until_; }
    [[nodiscard]] TimePoint until() const { return until_; }
    /// As of when deadlines are judged: the last look without grace, and never later than `now`.
    [[nodiscard]] TimePoint known(TimePoint now) const { return std::min(now, knownUntil_); }
    [[nodiscard]] std::optional<TimePoint> lastLook() const { return lastLook_; }
    [[nodiscard]] std::optional<TimePoint> lastLookAtClock() const { return lastLookAtClock_; }

private:
    Duration longest_, moment_;
    std::optional<TimePoint> lastLook_, lastLookAtClock_;
    TimePoint until_{};
    TimePoint knownUntil_{};
    int inARow_ = 0;
};

}  // namespace tessera
