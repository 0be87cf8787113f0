/// Rows about render hosts: killed, stopped, twenty at once.
#include <fmt/format.h>
#include <signal.h>

#include <functional>

#include "tests/drill/DrillWall.h"
#include "tests/drill/Rows.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

/// Something is done to one host after the other, and taken back. `undo` returns when it began.
using Deed = std::function<TimePoint(DrillWall&, const std::string& host)>;
Measurement eachHost(const DrillOptions& options, int signal, const Deed& undo) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    measured.bytes = 0;
    for (int i = 0; i < options.repetitions; ++i) {
        const std::string& host = kFourHosts[static_cast<std::size_t>(i) % kFourHosts.size()];
        wall.watchUndisturbed(measured, 1s);
        const std::uint64_t before = wall.networkBytes();
        const TimePoint done = now();
        wall.host(host).signal(signal);
        measured.noticedMs.push_back(toMilliseconds(wall.waitUntilGone(host, done, 10s) - done));
        const TimePoint undone = undo(wall, host);
        measured.backMs.push_back(toMilliseconds(wall.waitUntilBack(host, undone, 20s) - undone));
        wall.watch(300ms);
        measured.missed.push_back(wall.timeline().missed(done, now()));
        *measured.bytes += (wall.networkBytes() - before) / static_cast<std::uint64_t>(options.repetitions);
    }
    wall.conclude(measured, kFourHosts);
    return measured;
}

Measurement killHosts(const DrillOptions& options) {
    return eachHost(options, SIGKILL, [](DrillWall& wall, const std::string& host) {
        if (!wall.waitForExit(wall.host(host), 5s)) throw RowBroken(host + " survived SIGKILL");
        wall.watch(300ms);
        const TimePoint started = now();
        wall.startHost(host);
        return started;
    });
}

Measurement stopHosts(const DrillOptions& options) {
    return eachHost(options, SIGSTOP, [](DrillWall& wall, const std::string& host) {
        wall.watch(500ms);
        const TimePoint continued = now();
        wall.host(host).signal(SIGCONT);
        return continued;
    });
}

constexpr int kColumns = 6, kRows = 4;

/// A wall of 24 hosts of a tile each, which begins with whoever is there.
std::string wideWall(std::vector<std::string>& hosts) {
    std::string text = fmt::format(
        "screens {{ name: \"front\" lower_left {{ x: -3 y: 0 z: 0 }} lower_right {{ x: 3 y: 0 z: 0 }} upper_left {{ x: "
        "-3 y: 4 z: 0 }}\n"
        "  grid {{ columns: {} rows: {} tile_width_px: 96 tile_height_px: 96 }} }}\n"
        "users {{ name: \"viewer\" position {{ x: 0 y: 1.7 z: 3 }} }}\n",
        kColumns, kRows);
    for (int row = 0; row < kRows; ++row)
        for (int column = 0; column < kColumns; ++column) {
            hosts.push_back(fmt::format("host-{}-{}", column, row));
            text += fmt::format(
                "hosts {{ name: \"{}\" tiles {{ screen: \"front\" column: {} row: {} eye: CENTER user: \"viewer\" }} "
                "}}\n",
                hosts.back(), column, row);
        }
    return text +
           "sync { late_frame: WAIT frame_deadline_ms: 10000 heartbeat_ms: 100 lost_after_ms: 800 start_deadline_ms: "
           "1000 }\n";
}

Measurement joinTwenty(const DrillOptions& options) {
    const test::TemporaryFolder files;
    std::vector<std::string> hosts;
    const std::string wallFile = files.write("wide.wall", wideWall(hosts));
    const std::vector<std::string> first(hosts.begin(), hosts.begin() + 4);
    DrillWall wall({.wall = wallFile, .hosts = first, .scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    wall.watchUndisturbed(measured, 2s);
    const std::uint64_t before = wall.networkBytes();
    const TimePoint began = now();
    for (std::size_t i = first.size(); i < hosts.size(); ++i) wall.startHost(hosts[i]);
    measured.backMs.push_back(toMilliseconds(wall.waitUntilAllBack(began, 40s) - began));
    measured.missed.push_back(wall.timeline().missed(began, now()));
    measured.bytes = wall.networkBytes() - before;
    wall.conclude(measured, {});
    return measured;
}

}  // namespace

std::vector<Row> hostRows() {
    return {
        {.name = "kill-host",
         .deed = "a host killed, started again",
         .promise = {.missed = 3, .noticedMs = 100, .backMs = 10'000},
         .run = killHosts},
        {.name = "stop-host",
         .deed = "a host stopped, let go on",
         .promise = {.missed = 60, .noticedMs = 1'000, .backMs = 10'000},
         .run = stopHosts},
        {.name = "join-20",
         .deed = "20 hosts join 4 at once",
         .promise = {.missed = 20, .backMs = 20'000},
         .run = joinTwenty},
    };
}

}  // namespace tessera::drill
