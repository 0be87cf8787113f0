/// How far apart hosts show one frame: a wall of real processes beside a bare epoll release of as many, in the same
/// run, in turns, beside the same load. With the priorities that hosts ask for, and as a user who gets none.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/bench/EpollRelease.h"
#include "tests/bench/MachineLoad.h"
#include "tests/bench/SceneTable.h"
#include "tests/integration/LiveWall.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr uid_t kNobody = 65534;
constexpr double kAlwaysMs = 2, kBesideLoopsMs = 10, kTimesEpoll = 1.5;

struct Options {
    int runs = 5, frames = 120;
    std::string size, json;
    std::set<std::string> cases{"idle", "loops", "compiler", "first-run"};
    std::set<std::string> walls{"hall", "nothing"};
    bool share = true, withPrivileges = true, withoutPrivileges = true;
};

/// Of one run of a wall, or of one block of epoll releases.
struct Spread {
    double p50 = 0, p99 = 0, max = 0;
};
Spread spreadOf(std::vector<double> ms) {
    std::ranges::sort(ms);
    const auto at = [&](double share) {
        const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(ms.size())));
        return ms.empty() ? 0 : ms[std::clamp<std::size_t>(rank, 1, ms.size()) - 1];
    };
    return {at(0.5), at(0.99), at(1)};
}

struct WallRun {
    Spread spread;
    int skew = 0, faults = 0;
    double others = 0;  ///< processors that neither the wall nor the load of this benchmark took
    std::string refused;
    std::string widest;  ///< which frame had the widest spread, and who showed it last
};

/// Runs its command as somebody without privileges, where this program has some.
std::vector<std::string> asNobody(std::vector<std::string> command) {
    if (::geteuid() != 0) return command;
    const std::string id = std::to_string(kNobody);
    std::vector<std::string> dropped{"/usr/bin/setpriv", "--reuid",        id,  "--regid", id,
                                     "--clear-groups",   "--no-new-privs", "--"};
    dropped.insert(dropped.end(), command.begin(), command.end());
    return dropped;
}

/// The first on the way to a file that others may not read or go through; nothing: they may read it.
std::optional<fs::path> closedToOthers(const fs::path& file) {
    fs::path at;
    for (const fs::path& part : fs::absolute(file)) {
        at /= part;
        std::error_code failed;
        const fs::perms needed = fs::is_directory(at, failed) ? fs::perms::others_exec : fs::perms::others_read;
        if ((fs::status(at, failed).permissions() & needed) == fs::perms::none) return at;
    }
    return std::nullopt;
}

class Walls {
public:
    Walls(const Options& options, SceneTable& table) : options_(options), table_(table) {}

    [[nodiscard]] std::optional<WallRun> run(const std::string& wall, const std::string& load, bool privileged) {
        const test::TemporaryFolder folder;
        for (const char* name : {"", "out", "cache"}) {
            fs::create_directories(fs::path(folder.path()) / name);
            if (!privileged && ::geteuid() == 0 && ::chown((folder.path() + "/" + name).c_str(), kNobody, kNobody) != 0)
                return std::nullopt;
        }
        const auto as = [&](std::vector<std::string> command) {
            return privileged ? command : asNobody(std::move(command));
        };
        std::vector<std::string> serve{test::program("tessera-server"),
                                       "--wall",
                                       "2x2",
                                       "--listen",
                                       "127.0.0.1:0",
                                       "--report",
                                       folder.path() + "/out/report.json",
                                       "--frames",
                                       std::to_string(options_.frames)};
        const bool draws = wall == "hall";
        if (draws)
            serve.insert(serve.end(), {"--scene", TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct", "--assets",
                                       "/usr/share/assimp/models"});
        else
            serve.insert(serve.end(), {"--scene", TESSERA_SOURCE_DIR "/tests/data/scenes/yard.tsct", "--rate", "60"});
        if (!options_.size.empty()) serve.insert(serve.end(), {"--size", options_.size});
        // Programs that were compiled before, or none.
        const std::string cache = load == "first-run" ? folder.path() + "/cache" : warmCache(privileged);
        const MachineLoad before = MachineLoad::now();
        test::Process server(folder.path(), "server", as(serve));
        const auto address = server.waitForText("listening on ", 60s);
        if (!address) return complain("the server does not listen", server.output());
        std::vector<test::Process> clients;
        for (const std::string& host : test::kFourHosts) {
            std::vector<std::string> command{"/usr/bin/env",
                                             "MESA_SHADER_CACHE_DIR=" + cache,
                                             "MESA_GLSL_CACHE_DIR=" + cache,
                                             test::program("tessera-client"),
                                             "--server",
                                             *address,
                                             "--host",
                                             host};
            if (draws)
                command.insert(command.end(), {"--output", folder.path() + "/out"});
            else
                command.insert(command.end(), {"--surface", "none"});
            if (!options_.share) command.insert(command.end(), {"--share", "off"});
            clients.emplace_back(folder.path(), host, as(command));
        }
        const auto ended = server.waitForExit(std::chrono::minutes(10));
        for (test::Process& client : clients) (void)client.waitForExit(20s);
        const std::string text = test::readText(folder.path() + "/out/report.json");
        if (ended != 0 || text.empty()) return complain("the wall did not run to its end", server.output());
        const auto report = nlohmann::json::parse(text);
        const auto& sync = report["sync"];
        WallRun result{
            .spread = {sync["swap_spread_ms"]["p50"], sync["swap_spread_ms"]["p99"], sync["swap_spread_ms"]["max"]},
            .skew = sync["worst_skew_frames"],
            .faults = static_cast<int>(report["faults"].size()),
            .others = MachineLoad::now().othersSince(before),
            .refused = {},
            .widest = fmt::format("frame {}, {} last", sync["widest_swap"]["frame"].get<std::uint64_t>(),
                                  sync["widest_swap"]["last"].get<std::string>())};
        const std::string said = clients.front().output();
        if (const std::size_t at = said.find("(refused: "); at != std::string::npos)
            result.refused = said.substr(at + 10, said.find(')', at) - at - 10);
        return result;
    }

private:
    /// One for each user: what one has compiled the other must not believe.
    std::string warmCache(bool privileged) {
        const std::string cache = caches_.path() + (privileged ? "/ours" : "/nobody");
        if (!fs::exists(cache)) {
            fs::create_directories(cache);
            fs::permissions(caches_.path(), fs::perms::others_exec | fs::perms::others_read, fs::perm_options::add);
            if (!privileged && ::geteuid() == 0 && ::chown(cache.c_str(), kNobody, kNobody) != 0) return cache;
        }
        return cache;
    }
    std::optional<WallRun> complain(const std::string& what, const std::string& said) {
        table_.complain(what + ":\n" + said);
        return std::nullopt;
    }

    const Options& options_;
    SceneTable& table_;
    test::TemporaryFolder caches_;
};

/// What this program puts beside the wall; gone with it.
std::unique_ptr<Load> loadOf(const std::string& name) {
    if (name == "loops") return Load::loops(2);
    if (name == "compiler") return Load::compilers(2);
    return Load::none();
}

std::string nameOf(const std::string& load) {
    if (load == "loops") return "beside two busy loops";
    if (load == "compiler") return "beside a compiler";
    if (load == "first-run") return "first run, empty caches";
    return "idle";
}

struct Series {
    std::vector<WallRun> ours;
    std::vector<Spread> theirs;
};

double medianOf(const std::vector<double>& values) {
    return spreadOf(values).p50;
}
template <typename T, typename F>
std::vector<double> each(const std::vector<T>& of, F get) {
    std::vector<double> values;
    for (const T& one : of) values.push_back(get(one));
    return values;
}

void addRows(SceneTable& table, const std::string& what, const std::string& load, const Series& series) {
    if (series.ours.empty()) return;
    int skewed = 0, faults = 0;
    double others = 0;
    for (const WallRun& run : series.ours) {
        skewed += run.skew > 0;
        faults += run.faults;
        others = std::max(others, run.others);
    }
    const auto add = [&](const std::string& name, double Spread::*which, bool judged, const std::string& remark) {
        const double ours = medianOf(each(series.ours, [&](const WallRun& r) { return r.spread.*which; }));
        const double theirs = medianOf(each(series.theirs, [&](const Spread& s) { return s.*which; }));
        const double floor = load == "loops" ? kBesideLoopsMs : kAlwaysMs;
        table.add({.operation = fmt::format("{}, {}: {}", what, nameOf(load), name),
                   .peer = "bare epoll",
                   .ours = {.value = ours, .count = series.ours.size()},
                   .theirs = {.value = theirs, .count = series.theirs.size()},
                   .unit = "ms",
                   .atMost = judged ? std::max(kTimesEpoll, floor / std::max(theirs, 1e-6)) : 0,
                   .remark = remark});
    };
    add("spread p50", &Spread::p50, false, "");
    add("spread p99", &Spread::p99, true,
        fmt::format("of {} runs, worst skew above 0 in {}, {} faults", series.ours.size(), skewed, faults));
    const double worst = std::ranges::max(each(series.ours, [](const WallRun& r) { return r.spread.max; }));
    add("spread max", &Spread::max, false,
        fmt::format("the worst of all {:.1f}; others took up to {:.2f} processors", worst, others));
    if (skewed > 0)
        table.complain(fmt::format("{}, {}: in {} of {} runs hosts were a frame apart", what, nameOf(load), skewed,
                                   series.ours.size()));
}

int bench(int argc, char** argv) {
    Options options;
    const auto words = [](const std::string& text) {
        std::set<std::string> all;
        std::istringstream in(text);
        for (std::string word; std::getline(in, word, ',');) all.insert(word);
        return all;
    };
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        const std::string value = i + 1 < argc ? argv[i + 1] : "";
        if (option == "--quick") options.runs = 1, options.frames = 40, options.size = "640x360";
        if (option == "--json") options.json = value;
        if (option == "--runs") options.runs = std::max(1, std::atoi(value.c_str()));
        if (option == "--frames") options.frames = std::max(20, std::atoi(value.c_str()));
        if (option == "--size") options.size = value;
        if (option == "--cases") options.cases = words(value);
        if (option == "--walls") options.walls = words(value);
        if (option == "--share") options.share = value != "off";
        if (option == "--privileges")
            options.withPrivileges = value != "without", options.withoutPrivileges = value != "with";
    }
    // Without any there is nothing to take away.
    if (::geteuid() != 0) options.withPrivileges = false;
    SceneTable table;
    if (::geteuid() == 0 && options.withoutPrivileges)
        for (const std::string& read : {test::program("tessera-server"), test::program("tessera-client"),
                                        std::string(TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct")})
            if (const auto closed = closedToOthers(read); closed && options.withoutPrivileges) {
                table.skip(
                    fmt::format("walls without privileges: user {} may not read {}; a copy of the project elsewhere "
                                "can be measured",
                                kNobody, closed->string()));
                options.withoutPrivileges = false;
            }
    Walls walls(options, table);
    std::map<std::tuple<std::string, std::string, bool>, Series> all;
    std::set<std::string> refused;
    // In turns, so that what else the machine does meets all alike.
    for (int round = 0; round < options.runs; ++round)
        for (const std::string load : {"idle", "loops", "compiler", "first-run"}) {
            if (!options.cases.contains(load)) continue;
            for (const std::string wall : {"hall", "nothing"})
                for (const bool privileged : {true, false}) {
                    if (!options.walls.contains(wall) ||
                        !(privileged ? options.withPrivileges : options.withoutPrivileges))
                        continue;
                    if (round == 0 && wall == "hall" && load != "first-run")
                        (void)walls.run(wall, load, privileged);  // programs
                    const std::unique_ptr<Load> beside = loadOf(load);
                    Series& series = all[{wall, load, privileged}];
                    EpollRelease bare(static_cast<int>(test::kFourHosts.size()),
                                      privileged ? std::nullopt : std::optional(kNobody));
                    const auto theirs = spreadOf(bare.releases(options.frames));
                    const auto ours = walls.run(wall, load, privileged);
                    if (!ours) continue;
                    series.theirs.push_back(theirs);
                    series.ours.push_back(*ours);
                    if (!ours->refused.empty()) refused.insert(ours->refused);
                    fmt::print(stderr,
                               "round {}: {}, {}, {} privileges: {:.2f} {:.2f} {:.2f} ms ({}), skew {}; epoll {:.2f} "
                               "{:.2f} {:.2f}; others {:.2f}\n",
                               round + 1, wall, nameOf(load), privileged ? "with" : "without", ours->spread.p50,
                               ours->spread.p99, ours->spread.max, ours->widest, ours->skew, theirs.p50, theirs.p99,
                               theirs.max, ours->others);
                }
        }
    for (const bool privileged : {true, false}) {
        if (!(privileged ? options.withPrivileges : options.withoutPrivileges)) continue;
        table.begin(
            fmt::format("instants at which four hosts show one frame, {} frames, median of {} runs, {} privileges",
                        options.frames, options.runs, privileged ? "with" : "without"));
        for (const std::string wall : {"hall", "nothing"})
            for (const std::string load : {"idle", "loops", "compiler", "first-run"})
                if (const auto found = all.find({wall, load, privileged}); found != all.end())
                    addRows(table,
                            fmt::format("{}{}", wall == "hall" ? "2x2 wall of the hall" : "a wall that draws nothing",
                                        privileged ? "" : ", no privileges"),
                            load, found->second);
    }
    for (const std::string& what : refused) fmt::print("  refused by the system: {}\n", what);
    table.summarise();
    return (options.json.empty() || table.writeJson(options.json)) && table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench(argc, argv);
}
