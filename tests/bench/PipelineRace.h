/// Frames of several contenders, measured in turns pass by pass; per frame the least over the passes counts.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "tests/bench/CollisionTimer.h"

namespace tessera {

/// Seconds of one frame.
struct FrameTimes {
    double asked = 0;  ///< the collision question alone
    double whole = 0;  ///< with all that a frame does besides: committing what was accepted, telling of it
};

/// The thread's own time where one thread works, else the wall's.
class FrameClock {
public:
    explicit FrameClock(Clock clock) : clock_(clock) {}
    template <typename Call>
    [[nodiscard]] double seconds(Call&& call) const {
        return clock_ == Clock::kThread ? timer_.seconds(call) : timer_.wallSeconds(call);
    }

private:
    Clock clock_;
    CallTimer timer_;
};

class FrameContender {
public:
    FrameContender() = default;
    virtual ~FrameContender() = default;
    FrameContender(const FrameContender&) = delete;
    FrameContender& operator=(const FrameContender&) = delete;
    /// Back to before the first frame. Not timed.
    virtual void start() = 0;
    /// Frames come in order, from 1.
    virtual FrameTimes frame(std::size_t f, const FrameClock& clock) = 0;
    /// After each frame of the first pass. Not timed.
    virtual void look(std::size_t) {}
};

/// Per contender and frame, the first frame left out (index 0 is frame 1).
struct RaceTimes {
    std::vector<std::vector<double>> asked, whole;
};

inline RaceTimes raceFrames(std::size_t frames, int passes, const std::vector<FrameContender*>& contenders,
                            Clock kind = Clock::kThread) {
    const FrameClock clock(kind);
    const std::vector<std::vector<double>> none(contenders.size(),
                                                std::vector<double>(frames, std::numeric_limits<double>::infinity()));
    RaceTimes best{none, none};
    for (int pass = 0; pass <= passes; ++pass)  // the first one warms up
        for (std::size_t c = 0; c < contenders.size(); ++c) {
            contenders[c]->start();
            for (std::size_t f = 1; f <= frames; ++f) {
                const FrameTimes taken = contenders[c]->frame(f, clock);
                if (pass == 0) {
                    contenders[c]->look(f);
                    continue;
                }
                best.asked[c][f - 1] = std::min(best.asked[c][f - 1], taken.asked);
                best.whole[c][f - 1] = std::min(best.whole[c][f - 1], taken.whole);
            }
        }
    return best;
}

}  // namespace tessera
