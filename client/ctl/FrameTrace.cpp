#include "client/ctl/FrameTrace.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {
namespace {

constexpr int kWall = 1;  ///< its process; hosts have those behind it
constexpr std::size_t kMostOpen = 64;

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

void FrameTrace::made(FrameNumber frame, TimePoint now) {
    open_.emplace(frame.value, now);
    if (open_.size() > kMostOpen) open_.erase(open_.begin());
}

void FrameTrace::shown(const notice::Frame& frame, TimePoint now) {
    const auto made = open_.find(frame.frame.value);
    if (made == open_.end()) return;
    const std::string name = fmt::format("frame {}", frame.frame.value);
    slice(kWall, name, made->second, now,
          {{"frame", frame.frame.value}, {"shown_by", frame.shown}, {"held_by", frame.held}});
    for (const std::string& host : frame.shown)
        slice(trackOf(host), name, made->second, now, {{"frame", frame.frame.value}});
    for (const std::string& host : frame.held)
        slice(trackOf(host), "holds an earlier one", made->second, now, {{"frame", frame.frame.value}});
    open_.erase(open_.begin(), std::next(made));
    ++frames_;
    end_ = now;
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
