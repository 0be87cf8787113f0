/// How much detail the frames of a wall leave away, so that hosts have them done in time.
#pragma once

#include <array>
#include <cstdint>

#include "common/codec/FrameCodec.h"
#include "common/wall/Detail.h"

namespace tessera {

/// Follows what the slowest host took for each frame and chooses the step (common/wall/Detail.h) of the next one.
///
/// - Coarser by one where two frames were late within kLateWithin, for one alone says little; or to the step that
/// motion was last held at.
/// - Finer by one where `patience` frames in a row took less than kRoom of the budget. What proves too fine at once is
/// tried again after twice
///   as many frames, up to kMostPatience: so a wall that stands between two steps changes ever more seldom.
/// - The first frame at a step does not count: it makes what the step before had no need of.
/// - A frame that every host shows again took nothing: a wall at rest comes back to all of its detail.
///
/// A state machine without a clock; frame thread only. Cost: a few numbers a frame.
class FrameBudget {
public:
    static constexpr unsigned kFirstPatience = 16, kMostPatience = 1024, kLateWithin = 16;
    static constexpr double kRoom = 0.6;  ///< below this share of the budget a step finer may fit

    /// 0: none; all frames are drawn with all of their detail.
    explicit FrameBudget(double milliseconds) : milliseconds_(milliseconds) {}
    /// From the next frame on.
    void set(double milliseconds);
    [[nodiscard]] double milliseconds() const { return milliseconds_; }

    /// Of the next frame.
    [[nodiscard]] unsigned step() const { return step_; }

    /// What one host took for a frame; then that the frame is over. Frames come one after the other.
    void drawn(const HostStats& host);
    void released();

    /// Frames released at each step, and how often the step has changed.
    [[nodiscard]] const std::array<std::uint64_t, kDetailSteps.size()>& framesAt() const { return framesAt_; }
    [[nodiscard]] std::uint64_t changes() const { return changes_; }
    /// Frames that took longer than the budget that there was then.
    [[nodiscard]] std::uint64_t late() const { return late_; }

private:
    void judge(double milliseconds, bool still);
    void take(unsigned step);

    double milliseconds_;
    unsigned step_ = 0;
    unsigned held_ = 0;                                   ///< the step that moving frames were last held at
    unsigned framesHere_ = 0, inTime_ = 0, overdue_ = 0;  ///< at this step; of them in a row with room; kLateWithin for
                                                          ///< each late one, less one for each in time
    bool finer_ = false;                                  ///< this step was tried from a coarser one, in motion
    std::array<unsigned, kDetailSteps.size()> patience_ =
        patienceAtFirst();  ///< before a step is tried from the next coarser one
    // Of the frame that is open:
    double slowest_ = 0;
    bool anyHost_ = false, anyDrawn_ = false;
    std::array<std::uint64_t, kDetailSteps.size()> framesAt_{};
    std::uint64_t changes_ = 0, late_ = 0;

    static constexpr std::array<unsigned, kDetailSteps.size()> patienceAtFirst() {
        std::array<unsigned, kDetailSteps.size()> all{};
        all.fill(kFirstPatience);
        return all;
    }
};

}  // namespace tessera
