#include "tests/drill/FrameTimeline.h"

#include <algorithm>
#include <cmath>

namespace tessera::drill {
namespace {

bool among(const std::string& host, const SeenFrame& frame) {
    return std::ranges::find(frame.hosts, host) != frame.hosts.end();
}

}  // namespace

void FrameTimeline::add(SeenFrame frame) {
    if (!frame.hosts.empty()) frames_.push_back(std::move(frame));
}

Duration FrameTimeline::longestGap(TimePoint from, TimePoint to) const {
    Duration longest{};
    TimePoint last = from;
    for (const SeenFrame& frame : frames_) {
        if (frame.at < from) continue;
        if (frame.at > to) break;
        longest = std::max(longest, frame.at - last);
        last = frame.at;
    }
    return std::max(longest, to - last);
}

double FrameTimeline::framesOf(Duration gap) const {
    return std::max(0.0, std::round(toMilliseconds(gap) * rateHz_ / 1000) - 1);
}

std::vector<double> FrameTimeline::intervalsMs(TimePoint from, TimePoint to) const {
    std::vector<double> intervals;
    const SeenFrame* last = nullptr;
    for (const SeenFrame& frame : frames_) {
        if (frame.at < from || frame.at > to) continue;
        if (last) intervals.push_back(toMilliseconds(frame.at - last->at));
        last = &frame;
    }
    return intervals;
}

std::optional<TimePoint> FrameTimeline::firstWith(const std::string& host, TimePoint since) const {
    for (const SeenFrame& frame : frames_)
        if (frame.at >= since && among(host, frame)) return frame.at;
    return std::nullopt;
}

std::optional<TimePoint> FrameTimeline::firstWithout(const std::string& host, TimePoint since) const {
    for (const SeenFrame& frame : frames_)
        if (frame.at >= since && !among(host, frame)) return frame.at;
    return std::nullopt;
}

std::optional<TimePoint> FrameTimeline::wholeFrom(const std::vector<std::string>& hosts, TimePoint since) const {
    std::optional<TimePoint> from;
    for (const SeenFrame& frame : frames_) {
        if (frame.at < since) continue;
        const bool whole = std::ranges::all_of(hosts, [&](const std::string& host) { return among(host, frame); });
        if (!whole)
            from.reset();
        else if (!from)
            from = frame.at;
    }
    return from;
}

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
    const std::size_t index = std::clamp<std::size_t>(rank, 1, values.size()) - 1;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(index));
    return values[index];
}

}  // namespace tessera::drill
