#include "server/sim/FramePacing.h"

#include <algorithm>

#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

Duration fromSeconds(double seconds) {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

FramePacing::FramePacing(double rateHz) : interval_(rateHz > 0 ? fromSeconds(1 / rateHz) : Duration{0}) {}

void FramePacing::began(TimePoint now) {
    open_ = true;
    beganAt_ = now;
    // A little late is made up for, or the rate would sink; a whole frame late is not, or two would come at once.
    earliest_ += interval_;
    if (earliest_ < now) earliest_ = now + interval_;
}

void FramePacing::released(TimePoint now, bool toNobody) {
    open_ = false;
    ++released_;
    // A frame that waited for a host that was lost says nothing about the next.
    constexpr Duration kLongest = std::chrono::milliseconds(200);
    usualLength_ += (std::min(now - beganAt_, kLongest) - usualLength_) / 8;
    if (toNobody) earliest_ = std::max(earliest_, now + fromSeconds(kSecondsPerFrame));
}

}  // namespace tessera
