/// When the next frame may begin, as far as the clock decides.
#pragma once

#include "common/base/Clock.h"

namespace tessera {

/// A pure state machine beside the session's barrier, which waits for hosts: the rate that was asked for, and the pace
/// of a wall where nobody draws. Times are the caller's.
class FramePacing {
public:
    /// `rateHz`: frames per second at most; 0: as fast as the wall draws.
    explicit FramePacing(double rateHz);

    void began(TimePoint now);
    /// `toNobody`: no host showed it. Frames would fly by; simulation time then keeps the pace of the clock.
    void released(TimePoint now, bool toNobody);

    [[nodiscard]] bool frameOpen() const { return open_; }
    [[nodiscard]] std::uint64_t framesReleased() const { return released_; }
    /// From a frame's beginning to its Swap, of late: what a frame that begins now may expect.
    [[nodiscard]] Duration usualLength() const { return usualLength_; }
    /// Of the next frame.
    [[nodiscard]] TimePoint earliest() const { return earliest_; }

private:
    Duration interval_;
    bool open_ = false;
    std::uint64_t released_ = 0;
    TimePoint earliest_{};
    TimePoint beganAt_{};
    Duration usualLength_ = std::chrono::milliseconds(16);
};

}  // namespace tessera
