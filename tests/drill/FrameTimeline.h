/// When a wall showed its frames and who was among them, as an application saw it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/Clock.h"

namespace tessera::drill {

struct SeenFrame {
    TimePoint at;                    ///< when the application was told
    std::vector<std::string> hosts;  ///< that showed it
};

/// Frames in the order in which they came. One that no host showed counts for nothing.
class FrameTimeline {
public:
    explicit FrameTimeline(double rateHz) : rateHz_(rateHz) {}

    void add(SeenFrame frame);
    [[nodiscard]] std::size_t size() const { return frames_.size(); }
    [[nodiscard]] const std::vector<SeenFrame>& frames() const { return frames_; }

    /// Longest time without a new frame. One that began before `from` or lasts beyond `to` counts with its part
    /// between.
    [[nodiscard]] Duration longestGap(TimePoint from, TimePoint to) const;
    /// How many frames a wall at its pace would have shown within a gap.
    [[nodiscard]] double framesOf(Duration gap) const;
    [[nodiscard]] double missed(TimePoint from, TimePoint to) const { return framesOf(longestGap(from, to)); }
    /// The times from each frame to the next, in ms.
    [[nodiscard]] std::vector<double> intervalsMs(TimePoint from, TimePoint to) const;
    /// When the first frame since then came that this host showed, or did not show.
    [[nodiscard]] std::optional<TimePoint> firstWith(const std::string& host, TimePoint since) const;
    [[nodiscard]] std::optional<TimePoint> firstWithout(const std::string& host, TimePoint since) const;
    /// From which frame since then on all of these hosts showed every one. Nothing when the last one lacks any.
    [[nodiscard]] std::optional<TimePoint> wholeFrom(const std::vector<std::string>& hosts, TimePoint since) const;

private:
    double rateHz_;
    std::vector<SeenFrame> frames_;
};

/// The smallest value that at least `share` of all do not exceed; 0 for none.
[[nodiscard]] double quantile(std::vector<double> values, double share);

}  // namespace tessera::drill
