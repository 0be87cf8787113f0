#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>

#include <nlohmann/json.hpp>

#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"
#include "tests/integration/LiveWall.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

constexpr int kFrames = 120;

/// Where Mesa keeps compiled programs, for what is started meanwhile: a folder that nobody has used.
class EmptyShaderCache {
public:
    EmptyShaderCache() {
        if (const char* before = std::getenv(kName)) before_ = before;
        ::setenv(kName, folder_.path().c_str(), 1);
    }
    ~EmptyShaderCache() { before_ ? ::setenv(kName, before_->c_str(), 1) : ::unsetenv(kName); }
    EmptyShaderCache(const EmptyShaderCache&) = delete;
    EmptyShaderCache& operator=(const EmptyShaderCache&) = delete;

private:
    static constexpr const char* kName = "MESA_SHADER_CACHE_DIR";
    test::TemporaryFolder folder_;
    std::optional<std::string> before_;
};

struct FirstMinute {
    double medianMs = 0, worstMs = 0;
    double firstMs = 0;  ///< the first frame, from Begin to its release
    std::string worst;   ///< which frame that was, and which host took how long for what
};

/// From one frame's release to the next one's, from the first that is shown on; and what hosts did in the longest.
std::optional<FirstMinute> readTrace(const nlohmann::json& trace) {
    std::map<std::int64_t, std::string> hosts;
    std::int64_t wall = -1;
    struct Shown {
        double from, to;
        std::string name;
    };
    std::vector<Shown> shown;
    for (const auto& event : trace["traceEvents"]) {
        if (event["ph"] != "M") continue;
        const std::string name = event["args"]["name"];
        if (name.starts_with("wall ")) wall = event["pid"];
        if (name.starts_with("host ")) hosts[event["pid"].get<std::int64_t>()] = name.substr(5);
    }
    for (const auto& event : trace["traceEvents"]) {
        if (event["ph"] != "X" || event["pid"] != wall) continue;
        const double from = event["ts"];
        shown.push_back({from, from + event["dur"].get<double>(), event["name"]});
    }
    if (shown.size() < kFrames / 2) return std::nullopt;
    FirstMinute found{.firstMs = (shown.front().to - shown.front().from) / 1e3, .worst = {}};
    std::vector<double> taken;
    std::size_t longest = 1;
    for (std::size_t i = 1; i < shown.size(); ++i) {
        taken.push_back((shown[i].to - shown[i - 1].to) / 1e3);
        if (taken.back() >= taken[longest - 1]) longest = i;
    }
    found.worstMs = taken[longest - 1];
    found.medianMs = medianOf(taken).value;
    double most = 0;
    for (const auto& event : trace["traceEvents"]) {
        if (event["ph"] != "X" || !event["args"].contains("ms") || !hosts.contains(event["pid"])) continue;
        const double ms = event["args"]["ms"], from = event["ts"];
        if (from < shown[longest - 1].to || from > shown[longest].to || ms < most) continue;
        most = ms;
        found.worst = fmt::format("{}, {}: {} {:.0f} ms", shown[longest].name, hosts[event["pid"]],
                                  event["name"].get<std::string>(), ms);
    }
    return found;
}

/// The default wall, which nobody has drawn on this machine before.
std::optional<FirstMinute> runFirstMinute(SceneTable& table) {
    const EmptyShaderCache cache;
    test::LiveWall wall({.scene = TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct",
                         .size = "",
                         .server = {"--assets", test::kModels, "--frames", std::to_string(kFrames)}});
    if (wall.address().empty()) {
        table.complain("the server of a wall did not listen:\n" + wall.logs());
        return std::nullopt;
    }
    const std::string file = wall.folder() + "/trace.json";
    test::Process trace(wall.folder(), "trace",
                        {test::program("tessera-ctl"), "--server", wall.address(), "--timeout", "60", "trace", file,
                         "--frames", std::to_string(kFrames)});
    for (const std::string& host : test::kFourHosts) wall.startClient(host);
    const nlohmann::json report = wall.waitForEnd(600s);
    (void)trace.waitForExit(20s);
    const std::string text = test::readText(file);
    const auto read = text.empty() ? nlohmann::json() : nlohmann::json::parse(text, nullptr, false);
    const auto found = read.contains("traceEvents") ? readTrace(read) : std::nullopt;
    if (!found || report.empty()) {
        table.complain("a wall's first minute was not seen to its end:\n" + wall.logs() + trace.output());
        return std::nullopt;
    }
    return found;
}

}  // namespace

void firstMinuteRows(SceneTable& table, int rounds) {
    table.begin("the default wall's first minute, no program compiled before; wall time from frame to frame");
    if (test::engineIsMissing()) return table.skip("models of Debian's assimp-testmodels");
    std::vector<FirstMinute> all;
    for (int round = 0; round < rounds; ++round) {
        const auto found = runFirstMinute(table);
        if (!found) return;
        all.push_back(*found);
        fmt::print(stderr, "round {}: median {:.0f} ms, worst {:.0f} ms ({}), the first {:.0f} ms\n", round + 1,
                   found->medianMs, found->worstMs, found->worst, found->firstMs);
    }
    std::ranges::sort(all, {}, [](const FirstMinute& m) { return m.worstMs / m.medianMs; });
    const FirstMinute& median = all[all.size() / 2];
    table.add(
        {.operation = "the worst frame after the first",
         .peer = "the median one",
         .ours = {.value = median.worstMs, .spread = 0, .count = all.size()},
         .theirs = {.value = median.medianMs, .spread = 0, .count = all.size()},
         .unit = "ms",
         .atMost = 1.5,
         .aim = 1.2,
         .remark = fmt::format("{}; {} runs from {:.2f} to {:.2f}", median.worst, all.size(),
                               all.front().worstMs / all.front().medianMs, all.back().worstMs / all.back().medianMs)});
}

}  // namespace tessera::bench
