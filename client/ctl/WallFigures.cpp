#include "client/ctl/WallFigures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "client/ctl/TextTable.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;

double millisecondsOf(Duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}

std::string figuresText(const char* name, const answer::Figures& figures) {
    if (figures.count == 0) return fmt::format("{:<9} none yet\n", name);
    return fmt::format("{:<9} half within {:.2f} ms, 99 % within {:.2f} ms: {} frames since the start\n", name,
                       figures.halfMs, figures.p99Ms, figures.count);
}
Json figuresJson(const answer::Figures& figures) {
    return {{"count", figures.count}, {"half_ms", figures.halfMs}, {"p99_ms", figures.p99Ms}};
}

/// Of one host, all tiles: how often the others waited for it of late, and most of all why.
struct HostWait {
    std::uint64_t frames = 0;
    double ms = 0, worst = 0;
    std::string reason;
};
HostWait waitFor(const answer::Status& status, const std::string& host) {
    HostWait all;
    for (const answer::TileWait& wait : status.waits) {
        if (wait.host != host) continue;
        all.frames += wait.frames;
        all.ms += wait.ms;
        if (wait.ms < all.worst) continue;
        all.worst = wait.ms;
        all.reason = wait.reason.empty() ? wait.tile : fmt::format("{} ({})", wait.reason, wait.tile);
    }
    return all;
}

}  // namespace

void WallFigures::frame(const notice::Frame& frame, TimePoint now) {
    if (lastFrame_) longest_ = std::max(longest_, now - *lastFrame_);
    lastFrame_ = now;
    ++frames_;
    for (const std::string& host : frame.shown) ++hosts_[host].shown;
    for (const std::string& host : frame.held) ++hosts_[host].held;
    for (const notice::HostWork& work : frame.works) {
        Shown& shown = hosts_[work.host];
        ++shown.drawn;
        shown.drawMs += work.cullMs + work.drawMs;
        shown.longestMs = std::max(shown.longestMs, work.cullMs + work.drawMs);
    }
}

Answer WallFigures::take(const answer::Status& status, TimePoint now) {
    const double seconds = std::max(1e-3, millisecondsOf(now - since_) / 1e3);
    const double rate = static_cast<double>(frames_) / seconds;
    Answer answer;
    answer.text =
        fmt::format("wall      {}, frame {}: {:.1f} frames a second{}\n", status.wallName, status.frame.value, rate,
                    frames_ > 1 ? fmt::format(", {:.1f} ms at most between two", millisecondsOf(longest_)) : "");
    answer.text += figuresText("frame", status.frames) + figuresText("barrier", status.barrier);
    if (status.budgetMs > 0)
        answer.text += fmt::format("detail    step {} of {} left away for {} ms a frame\n", status.detail,
                                   kDetailSteps.size() - 1, status.budgetMs);
    if (!status.journalTrouble.empty())
        answer.text += fmt::format("journal   no edit is taken: {}\n", status.journalTrouble);
    if (!status.waitingFor.empty() && status.frames.count == 0)
        answer.text += fmt::format("waiting   for {} before the first frame\n", fmt::join(status.waitingFor, ", "));
    answer.text += "\n";

    TextTable table({"HOST", "STATE", "SHOWN", "HELD", "BEHIND", "DRAWS", "ROUND TRIP", "WAITED FOR"});
    Json hosts = Json::array();
    for (const answer::HostInfo& host : status.hosts) {
        const Shown counted = hosts_[host.name];
        const HostWait wait = waitFor(status, host.name);
        // The frame that is being made counts for nobody.
        const std::uint64_t newest = status.frame.value > 0 ? status.frame.value - 1 : 0;
        const std::uint64_t behind = newest - std::min(newest, host.lastShown.value);
        const double drawMs = counted.drawMs / static_cast<double>(std::max<std::uint64_t>(1, counted.drawn));
        table.add({host.name, host.state, fmt::format("{} of {}", counted.shown, frames_),
                   fmt::format("{}", counted.held), fmt::format("{}", behind > 1 ? behind : 0),
                   counted.drawn == 0 ? "-" : fmt::format("{:.1f} ms, {:.1f} at most", drawMs, counted.longestMs),
                   fmt::format("{:.2f} ms", host.roundTripMs),
                   wait.frames == 0 ? "-"
                                    : fmt::format("{} of {}, {:.1f} ms each: {}", wait.frames, status.waitFrames,
                                                  wait.ms / static_cast<double>(wait.frames), wait.reason)});
        hosts.push_back({{"name", host.name},
                         {"state", host.state},
                         {"last_shown", host.lastShown.value},
                         {"shown", counted.shown},
                         {"held", counted.held},
                         {"draw_ms", counted.drawn > 0 ? Json(drawMs) : Json(nullptr)},
                         {"longest_draw_ms", counted.drawn > 0 ? Json(counted.longestMs) : Json(nullptr)},
                         {"round_trip_ms", host.roundTripMs},
                         {"waited_for", {{"frames", wait.frames}, {"ms", wait.ms}, {"reason", wait.reason}}}});
    }
    answer.text += table.text();
    answer.json = {{"wall", status.wallName},
                   {"frame", status.frame.value},
                   {"seconds", seconds},
                   {"frames", frames_},
                   {"frames_a_second", rate},
                   {"longest_ms", frames_ > 1 ? Json(millisecondsOf(longest_)) : Json(nullptr)},
                   {"frame_ms", figuresJson(status.frames)},
                   {"barrier_ms", figuresJson(status.barrier)},
                   {"budget_ms", status.budgetMs},
                   {"detail", status.detail},
                   {"journal_trouble", status.journalTrouble},
                   {"waiting_for", status.waitingFor},
                   {"wait_frames", status.waitFrames},
                   {"hosts", std::move(hosts)}};
    *this = WallFigures(now);
    return answer;
}

}  // namespace tessera
