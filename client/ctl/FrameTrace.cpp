#include "client/ctl/FrameTrace.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {
namespace {

constexpr int kWall = 1;  ///< its process; hosts have those behind it

Duration fromMs(double ms) {
    constexpr double kMost = 1e12;  // a generation
    if (!(ms > 0 && ms < kMost)) return {};
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms));
}

}  // namespace

double FrameTrace::microseconds(TimePoint time) const {
    return std::chrono::duration<double, std::micro>(time - begin_).count();
}

double FrameTrace::seconds() const {
    return std::max(0.0, microseconds(end_) / 1e6);
}

int FrameTrace::trackOf(const std::string& host) {
    return hosts_.try_emplace(host, kWall + 1 + static_cast<int>(hosts_.size())).first->second;
}

void FrameTrace::slice(int process, const std::string& name, TimePoint from, TimePoint to, Json arguments) {
    events_.push_back(jsonLine({{"ph", "X"},
                                {"name", name},
                                {"pid", process},
                                {"tid", 1},
                                {"ts", microseconds(from)},
                                {"dur", std::chrono::duration<double, std::micro>(to - from).count()},
                                {"args", std::move(arguments)}}));
}

void FrameTrace::shown(const notice::Frame& frame, TimePoint now) {
    if (!serversZero_) serversZero_ = now - fromMs(frame.releasedMs);
    const TimePoint to = *serversZero_ + fromMs(frame.releasedMs), began = to - fromMs(frame.frameMs);
    if (began < begin_ || to <= end_) return;
    const TimePoint from = std::max(began, end_);  // slices of one track do not overlap
    const std::string name = fmt::format("frame {}", frame.frame.value);
    slice(kWall, name, from, to,
          {{"frame", frame.frame.value}, {"ms", frame.frameMs}, {"shown_by", frame.shown}, {"held_by", frame.held}});
    for (const notice::HostWork& done : frame.works) work(done, frame.frame, from, to);
    for (const std::string& host : frame.held)
        slice(trackOf(host), "holds an earlier one", from, to, {{"frame", frame.frame.value}});
    ++frames_;
    end_ = to;
}

void FrameTrace::work(const notice::HostWork& work, FrameNumber frame, TimePoint from, TimePoint to) {
    const int process = trackOf(work.host);
    Json arguments{{"frame", frame.value}, {"ready_ms", work.readyMs}, {"work_ms", work.workMs}};
    if (work.lastShown.value > 0) {
        arguments["last_seen"] = work.lastShown.value;
        arguments["seen_ms_before_its_end"] = work.shownMs;
    }
    slice(process, fmt::format("frame {}", frame.value), from, to, std::move(arguments));
    const TimePoint ready = std::clamp(from + fromMs(work.readyMs), from, to);
    const TimePoint began = std::max(from, ready - fromMs(work.workMs));
    slice(process, "works", began, ready, Json::object());
    TimePoint at = began;
    for (const auto& [name, ms] : {std::pair("apply", work.applyMs), std::pair("cull", work.cullMs),
                                   std::pair("draw", work.drawMs), std::pair("hand over", work.handOverMs)}) {
        const TimePoint end = std::min(ready, at + fromMs(ms));
        if (end > at) slice(process, name, at, end, {{"ms", ms}});
        at = end;
    }
    if (ready < to) slice(process, "waits for the others", ready, to, Json::object());
}

void FrameTrace::status(const answer::Status& status, TimePoint now) {
    std::map<std::string, double> waits;
    for (const answer::HostInfo& host : status.hosts) waits[host.name];
    for (const answer::TileWait& wait : status.waits) waits[wait.host] += wait.ms;
    const double frames = static_cast<double>(std::max<std::uint64_t>(1, status.waitFrames));
    for (const auto& [host, ms] : waits)
        events_.push_back(jsonLine({{"ph", "C"},
                                    {"name", "others wait, ms a frame"},
                                    {"pid", trackOf(host)},
                                    {"tid", 1},
                                    {"ts", microseconds(now)},
                                    {"args", {{"ms", ms / frames}}}}));
}

void FrameTrace::states(const notice::States& states, TimePoint now) {
    for (const answer::HostInfo& host : states.hosts) {
        const int process = trackOf(host.name);
        std::string& known = states_[host.name];
        if (known == host.state) continue;
        known = host.state;
        events_.push_back(jsonLine({{"ph", "i"},
                                    {"name", host.state},
                                    {"pid", process},
                                    {"tid", 1},
                                    {"s", "p"},
                                    {"ts", std::max(0.0, microseconds(now))}}));
    }
}

std::string FrameTrace::text() const {
    const auto named = [](int process, const std::string& name) {
        return jsonLine({{"ph", "M"}, {"name", "process_name"}, {"pid", process}, {"args", {{"name", name}}}});
    };
    std::vector<std::string> lines{named(kWall, "wall " + wall_)};
    for (const auto& [host, process] : hosts_) lines.push_back(named(process, "host " + host));
    lines.insert(lines.end(), events_.begin(), events_.end());
    std::string text = "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";
    for (std::string& line : lines) {
        while (line.ends_with('\n')) line.pop_back();
        text += line + (&line == &lines.back() ? "\n" : ",\n");
    }
    return text + "]}\n";
}

}  // namespace tessera
