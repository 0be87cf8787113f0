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

constexpr const char* kModels = "/usr/share/assimp/models";

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

std::string wallCommand(const std::string& program, const std::string& wall, int frames, const std::string& folder,
                        const std::string& share) {
    return fmt::format(
        "'{}' --wall '{}' --scene '{}/deploy/scenes/engine-hall.tsct' --assets {} --frames {} --output '{}' --share {} "
        "--verbose",
        program, wall, TESSERA_SOURCE_DIR, kModels, frames, folder, share);
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

/// Says which of these files is not there.
bool isMissing(SceneTable& table, const std::vector<std::string>& files) {
    const auto gone = std::ranges::find_if(files, [](const std::string& file) { return !fs::exists(file); });
    if (gone != files.end()) table.skip("walls of processes: " + *gone + " is missing");
    return gone != files.end();
}

class OwnFolder {
public:
    OwnFolder() {
        if (!mkdtemp(path_.data())) std::abort();
    }
    ~OwnFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }

private:
    std::string path_ = fs::temp_directory_path() / "tessera-wall-row-XXXXXX";
};

}  // namespace

void wallRows(SceneTable& table, const std::string& program, int frames, int rounds) {
    const std::string wall = fs::path(program).parent_path() / "tessera-wall";
    table.begin("walls of processes");
    if (isMissing(table, {wall, kModels})) return;
    const OwnFolder own;
    const std::string& folder = own.path();
    std::ofstream(folder + "/three-and-one.wall") << kThreeAndOne;
    const std::vector<std::pair<std::string, std::string>> walls = {
        {"default wall, 2x2", "2x2"}, {"two hosts, three tiles and one", folder + "/three-and-one.wall"}};
    for (const auto& [name, file] : walls) {
        std::vector<WallCost> with, without;
        for (int round = 0; round < rounds; ++round)
            for (const bool shared : {false, true}) {
                const auto cost = runWall(wallCommand(wall, file, frames, folder, shared ? "auto" : "off"), frames);
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
}

void wallBeforeRows(SceneTable& table, const std::string& program, const std::string& before, int frames, int rounds) {
    table.begin("the default wall, beside the programs of another build");
    const std::string ours = fs::path(program).parent_path() / "tessera-wall", theirs = before + "/tessera-wall";
    if (before.empty()) return table.skip("the default wall beside another build: --before FOLDER names its programs");
    if (isMissing(table, {ours, theirs, kModels})) return;
    const OwnFolder folder;
    std::vector<double> ourMs, theirMs;
    double ourFrame = 0, theirFrame = 0;
    for (int round = 0; round < rounds; ++round)
        for (const bool own : {true, false}) {
            const auto cost = runWall(wallCommand(own ? ours : theirs, "2x2", frames, folder.path(), "auto"), frames);
            if (!cost) return table.complain("the default wall did not run to its end");
            (own ? ourMs : theirMs).push_back(cost->processorMs);
            (own ? ourFrame : theirFrame) += cost->frameMs / rounds;
        }
    table.add({.operation = "a frame, processor time of the four hosts",
               .peer = "the other build",
               .ours = medianOf(ourMs),
               .theirs = medianOf(theirMs),
               .unit = "ms",
               .atMost = 0.8,
               .aim = 0.6,
               .remark = fmt::format("wall time {:.0f} and {:.0f} ms", ourFrame, theirFrame)});
}

}  // namespace tessera::bench
