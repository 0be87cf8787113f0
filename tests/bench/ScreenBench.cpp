/// Walls on screens: what windows cost a wall, how long after Swap a picture stands in its window, how far apart four
/// windows show a frame, and surfaces beside each other. The engine hall on four tiles, real processes, under Xvfb; for
/// surfaces the city too. `--frames N`, `--rows windows,city,poses`, `--json FILE`.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/bench/SceneTable.h"
#include "tests/bench/ScreenRows.h"
#include "tests/integration/Desktop.h"
#include "tests/integration/Process.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

struct ScreenOptions {
    int frames = 120;
    std::string rows = "windows,city,poses";
    std::string json;
};

double atShare(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}
Median plain(double value) {
    return {.value = value, .spread = 0, .count = 1};
}

/// Of one run.
struct ScreenRun {
    double frameMs = 0;                        ///< median
    std::vector<double> toWindowMs, spreadMs;  ///< by picture, by frame
};

/// Its first pictures stand while windows open: they do not count.
constexpr std::uint64_t kFirstFrame = 20;

std::optional<ScreenRun> runOnce(const std::string& folder, const std::string& display, int frames,
                                 const std::vector<std::string>& more, const std::string& scene = "engine-hall") {
    std::vector<std::string> command = {"/usr/bin/env",
                                        "DISPLAY=" + display,
                                        test::program("tessera-wall"),
                                        "--wall",
                                        "2x2",
                                        "--scene",
                                        TESSERA_SOURCE_DIR "/deploy/scenes/" + scene + ".tsct",
                                        "--assets",
                                        "/usr/share/assimp/models",
                                        "--frames",
                                        std::to_string(frames),
                                        "--output",
                                        folder + "/out"};
    command.insert(command.end(), more.begin(), more.end());
    fs::remove_all(folder + "/logs");
    fs::create_directories(folder + "/logs");
    const test::Outcome outcome = test::run(folder, command, std::chrono::minutes(10));
    if (outcome.exitCode != 0) {
        std::fprintf(stderr, "%s\n", outcome.output.c_str());
        return std::nullopt;
    }
    ScreenRun run;
    run.frameMs = nlohmann::json::parse(test::readText(folder + "/out/report.json"))["frame_ms"]["p50"];
    std::map<std::uint64_t, std::vector<double>> stood;
    for (const auto& file : fs::directory_iterator(folder + "/logs")) {
        std::ifstream log(file.path());
        std::uint64_t frame = 0;
        for (double swapNs = 0, atNs = 0; log >> frame >> swapNs >> atNs;) {
            if (frame < kFirstFrame) continue;
            run.toWindowMs.push_back(1e-6 * (atNs - swapNs));
            stood[frame].push_back(1e-6 * atNs);
        }
    }
    for (const auto& [frame, at] : stood) {
        const auto [first, last] = std::minmax_element(at.begin(), at.end());
        if (at.size() == 4) run.spreadMs.push_back(*last - *first);
    }
    return run;
}

int bench(const ScreenOptions& options) {
    std::string folder = fs::temp_directory_path() / "tessera-screen-XXXXXX";
    if (!mkdtemp(folder.data())) return 1;
    SceneTable table;
    table.begin("engine hall on 2x2 tiles of 960x540");
    if (options.rows.find("windows") != std::string::npos) {
        test::Process desktop(
            folder, "xvfb",
            {"/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", "1920x1080x24", "-nolisten", "tcp", "-noreset"});
        std::string display;
        for (int i = 0; i < 200 && desktop.running() && display.empty(); ++i) {
            std::this_thread::sleep_for(50ms);
            display = test::Desktop::displayIn(desktop.output());
        }
        if (display.empty()) table.skip("Xvfb does not start");
        // In turns: each way twice, the faster one counts.
        std::map<std::string, ScreenRun> best;
        const std::map<std::string, std::vector<std::string>> ways = {
            {"plain", {}}, {"window", {"--window", "--window-log", folder + "/logs"}}, {"egl", {"--surface", "egl"}}};
        for (int round = 0; round < 2 && !display.empty(); ++round)
            for (const auto& [way, more] : ways) {
                auto run = runOnce(folder, display, options.frames, more);
                if (!run) {
                    table.complain(way + ": the wall did not run to its end");
                    continue;
                }
                auto [known, isNew] = best.try_emplace(way, *run);
                if (!isNew && run->frameMs < known->second.frameMs) known->second = std::move(*run);
            }
        if (best.size() == ways.size()) {
            table.add({.operation = "a frame of the wall in four windows",
                       .peer = "without windows",
                       .ours = plain(best["window"].frameMs),
                       .theirs = plain(best["plain"].frameMs),
                       .unit = "ms",
                       .atMost = 1.1});
            table.add({.operation = "a frame of the wall on EGL's first device",
                       .peer = "OSMesa",
                       .ours = plain(best["egl"].frameMs),
                       .theirs = plain(best["plain"].frameMs),
                       .unit = "ms"});
            const ScreenRun& shown = best["window"];
            for (const auto& [name, share] : {std::pair("p50", 0.5), std::pair("p99", 0.99)}) {
                table.add({.operation = fmt::format("from Swap to the window, {}", name),
                           .peer = "",
                           .ours = plain(atShare(shown.toWindowMs, share)),
                           .unit = "ms",
                           .remark = fmt::format("{} pictures", shown.toWindowMs.size())});
                table.add(
                    {.operation = fmt::format("between the first and the last of four windows with frame n, {}", name),
                     .peer = "",
                     .ours = plain(atShare(shown.spreadMs, share)),
                     .unit = "ms",
                     .remark = fmt::format("{} frames", shown.spreadMs.size())});
            }
        }
    }
    if (options.rows.find("city") != std::string::npos) {
        table.begin("city on 2x2 tiles of 960x540");
        // In turns, and the median: which hosts come to help which is chance, and a run takes a fifth more or less by
        // it.
        std::map<std::string, std::vector<double>> ms;
        for (int round = 0; round < 5; ++round)
            for (const std::string surface : {"osmesa", "egl"}) {
                if (const auto run = runOnce(folder, "", options.frames, {"--surface", surface}, "city"))
                    ms[surface].push_back(run->frameMs);
                else
                    table.complain(surface + ": the city's wall did not run to its end");
            }
        if (ms["egl"].size() == 5 && ms["osmesa"].size() == 5)
            table.add({.operation = "a frame of the wall on EGL's first device",
                       .peer = "OSMesa",
                       .ours = plain(atShare(ms["egl"], 0.5)),
                       .theirs = plain(atShare(ms["osmesa"], 0.5)),
                       .unit = "ms",
                       .remark = "medians of 5 runs"});
    }
    if (options.rows.find("poses") != std::string::npos)
        for (const bool drawn : {false, true}) poseRows(table, folder, std::max(100, 2 * options.frames), drawn);
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    table.summarise();
    if (!options.json.empty() && !table.writeJson(options.json)) return 1;
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    tessera::bench::ScreenOptions options;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--frames") == 0) options.frames = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--rows") == 0) options.rows = argv[i + 1];
        if (std::strcmp(argv[i], "--json") == 0) options.json = argv[i + 1];
    }
    return tessera::bench::bench(options);
}
