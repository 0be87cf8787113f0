#include "tests/bench/WallRow.h"

#include <dirent.h>
#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <vector>

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;

constexpr const char* kThreeAndOne = R"(screens { name: "front"
  lower_left { x: -1.6 y: 0.6 z: 0 } lower_right { x: 1.6 y: 0.6 z: 0 } upper_left { x: -1.6 y: 2.4 z: 0 }
  grid { columns: 2 rows: 2 tile_width_px: 960 tile_height_px: 540 } }
users { name: "viewer" position { x: 0 y: 1.7 z: 2.4 } }
hosts { name: "three" tiles { screen: "front" column: 0 row: 0 user: "viewer" }
  tiles { screen: "front" column: 1 row: 0 user: "viewer" } tiles { screen: "front" column: 1 row: 1 user: "viewer" } }
hosts { name: "one" tiles { screen: "front" column: 0 row: 1 user: "viewer" } }
)";

/// Of one run, per frame: from release to release, and processor time of all clients.
struct WallCost {
    double frameMs = 0, processorMs = 0;
    std::string remark;
};

int coreCount() {
    cpu_set_t cores;
    return sched_getaffinity(0, sizeof cores, &cores) == 0 ? std::max(1, CPU_COUNT(&cores)) : 1;
}

/// All threads', to the nanosecond (/proc/PID/task/TID/schedstat, first number).
double processorMsOf(const std::vector<std::string>& processes) {
    double ms = 0;
    for (const std::string& process : processes) {
        std::error_code gone;
        for (const auto& task : fs::directory_iterator("/proc/" + process + "/task", gone)) {
            double ns = 0;
            if (std::ifstream(task.path() / "schedstat") >> ns) ms += ns * 1e-6;
        }
    }
    return ms;
}

/// From the first tenth of the frames that begins after a fifth of them, to the last tenth that begins before the end.
std::optional<WallCost> runWall(const std::string& command, int frames) {
    std::FILE* const said = popen((command + " 2>&1").c_str(), "r");
    if (!said) return std::nullopt;
    struct Mark {
        int frame;
        double atMs, processorMs;
    };
    std::vector<Mark> marks;
    std::vector<std::string> clients;
    WallCost cost;
    char line[1024];
    while (std::fgets(line, sizeof line, said)) {
        char process[32] = {};
        int done = 0, all = 0;
        if (std::sscanf(line, "tessera-wall: pid %31s role client", process) == 1 && std::strstr(line, "role client"))
            clients.emplace_back(process);
        else if (std::sscanf(line, "tessera-wall: %d of %d frames", &done, &all) == 2 && 5 * done >= frames &&
                 done < frames)
            marks.push_back(
                {done,
                 std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count(),
                 processorMsOf(clients)});
        else if (const char* waited = std::strstr(line, "waited longest"))
            cost.remark = std::string(waited, std::strcspn(waited, "\n"));
    }
    if (pclose(said) != 0 || marks.size() < 2) return std::nullopt;
    const double count = marks.back().frame - marks.front().frame;
    cost.frameMs = (marks.back().atMs - marks.front().atMs) / count;
    cost.processorMs = (marks.back().processorMs - marks.front().processorMs) / count;
    return cost;
}

Median only(double value) {
    return {.value = value, .spread = 0, .count = 1};
}

}  // namespace

void wallRows(SceneTable& table, const std::string& program, int frames, int rounds) {
    const std::string wall = fs::path(program).parent_path() / "tessera-wall";
    const std::string models = "/usr/share/assimp/models";
    table.begin("walls of processes");
    if (!fs::exists(wall) || !fs::exists(models)) {
        table.skip("walls of processes: " + (fs::exists(wall) ? models : wall) + " is missing");
        return;
    }
    std::string folder = fs::temp_directory_path() / "tessera-wall-row-XXXXXX";
    if (!mkdtemp(folder.data())) std::abort();
    std::ofstream(folder + "/three-and-one.wall") << kThreeAndOne;
    const std::vector<std::pair<std::string, std::string>> walls = {
        {"default wall, 2x2", "2x2"}, {"two hosts, three tiles and one", folder + "/three-and-one.wall"}};
    for (const auto& [name, file] : walls) {
        std::vector<WallCost> with, without;
        for (int round = 0; round < rounds; ++round)
            for (const bool shared : {false, true}) {
                const auto cost = runWall(
                    fmt::format("'{}' --wall '{}' --scene '{}/deploy/scenes/engine-hall.tsct' --assets {} --frames {} "
                                "--output '{}' --share {} --verbose",
                                wall, file, TESSERA_SOURCE_DIR, models, frames, folder, shared ? "auto" : "off"),
                    frames);
                if (!cost) {
                    table.complain(name + ": the wall did not run to its end");
                    break;
                }
                (shared ? with : without).push_back(*cost);
            }
        const double cores = coreCount();
        for (auto* costs : {&with, &without}) {
            if (costs->empty()) continue;
            std::ranges::sort(*costs, {}, [](const WallCost& c) { return c.frameMs / c.processorMs; });
            const WallCost& median = (*costs)[costs->size() / 2];
            table.add({.operation = name + ": a frame" + (costs == &with ? "" : ", --share off"),
                       .peer = fmt::format("its clients' processor time / {:.0f} cores", cores),
                       .ours = only(median.frameMs),
                       .theirs = only(median.processorMs / cores),
                       .unit = "ms",
                       .atMost = costs == &with ? 1.15 : 0,
                       .remark = median.remark});
        }
    }
    std::error_code ignored;
    fs::remove_all(folder, ignored);
}

}  // namespace tessera::bench
