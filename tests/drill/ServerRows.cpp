/// Rows about the server: killed, stopped, gone on from its journal, with a full disk, beside a second one.
#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>

#include "tests/drill/DrillWall.h"
#include "tests/drill/Rows.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

/// From the kill to everybody's first frame of the new server.
void killAndRestart(DrillWall& wall, Measurement& measured) {
    const TimePoint killed = now();
    wall.server().signal(SIGKILL);
    if (!wall.waitForExit(wall.server(), 5s)) throw RowBroken("the server survived SIGKILL");
    wall.watch(500ms);
    if (const auto lost = wall.connectionLost(killed)) measured.noticedMs.push_back(toMilliseconds(*lost - killed));
    const TimePoint started = now();
    wall.startServer();
    measured.backMs.push_back(toMilliseconds(wall.waitUntilAllBack(started, 30s) - started));
    for (const std::string& host : kFourHosts)
        if (!wall.host(host).running()) measured.broken.push_back(host + " ended with the server");
}

Measurement killServer(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    for (int i = 0; i < options.repetitions; ++i) {
        wall.watchUndisturbed(measured, 500ms);
        killAndRestart(wall, measured);
    }
    measured.bytes = wall.networkBytes();
    wall.conclude(measured, {});
    return measured;
}

Measurement stopServer(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    measured.bytes = 0;
    for (int i = 0; i < options.repetitions; ++i) {
        wall.watchUndisturbed(measured, 500ms);
        const std::uint64_t before = wall.networkBytes();
        wall.server().signal(SIGSTOP);
        wall.watch(2s);
        const TimePoint continued = now();
        wall.server().signal(SIGCONT);
        // Some host may give it up only now; it is back when nobody is missing any more.
        wall.watch(1s);
        (void)wall.waitUntilAllBack(now(), 20s);
        const std::optional<TimePoint> whole = wall.timeline().wholeFrom(kFourHosts, continued);
        if (whole)
            measured.backMs.push_back(toMilliseconds(*whole - continued));
        else
            measured.broken.push_back("some host comes and goes");
        *measured.bytes += (wall.networkBytes() - before) / static_cast<std::uint64_t>(options.repetitions);
    }
    wall.conclude(measured, kFourHosts);
    return measured;
}

Measurement goOnFromJournal(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes, false)),
                    .server = {"--journal", files.path() + "/journal"}});
    Measurement measured;
    wall.watchUndisturbed(measured, 500ms);
    const std::string untouched = wall.stateHash();
    for (int i = 0; i < options.repetitions; ++i) {
        if (const test::Outcome moved = wall.ctl({"move", "/mover", "1", "0", "0", "--by"}); moved.exitCode != 0)
            throw RowBroken("no move: " + moved.output);
        const std::string before = wall.stateHash();
        if (before == untouched) measured.broken.push_back("an edit left the state hash as it was");
        killAndRestart(wall, measured);
        if (const std::string after = wall.stateHash(); after != before)
            measured.broken.push_back(fmt::format("state {} became {}", before, after));
    }
    wall.conclude(measured, {});
    return measured;
}

/// A disk of so many bytes, for this process and those that it starts, as long as it lives.
class SmallDisk {
public:
    SmallDisk(const std::string& folder, int kilobytes) : folder_(folder) {
        mkdir(folder.c_str(), 0700);
        // In a mount namespace of our own nobody else sees it, and it ends with us.
        const bool apart = unshare(CLONE_NEWNS) == 0 && mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
        if (!apart || mount("drill", folder.c_str(), "tmpfs", 0, fmt::format("size={}k", kilobytes).c_str()) != 0)
            throw RowSkipped(std::string("no disk of its own (root is needed): ") + std::strerror(errno));
    }
    ~SmallDisk() { umount2(folder_.c_str(), MNT_DETACH); }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

private:
    std::string folder_;
};

/// Until nothing more goes onto the disk.
void fill(const std::string& path) {
    const int file = open(path.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    const std::vector<char> block(4096, 'x');
    while (write(file, block.data(), block.size()) > 0) continue;
    close(file);
}

Measurement fillDisk(const DrillOptions& options) {
    const test::TemporaryFolder files;
    const std::string disk = files.path() + "/disk";
    const SmallDisk small(disk, 32 * 1024);
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes)),
                    .server = {"--record", disk + "/show.tsr"},
                    .clients = {{"upper-left", {"--cache", disk + "/cache"}}}});
    Measurement measured;
    wall.watchUndisturbed(measured, 1s);
    const TimePoint from = now();
    fill(disk + "/ballast");
    const auto said = wall.server().waitForText("record", 10s);
    if (said)
        measured.noticedMs.push_back(toMilliseconds(now() - from));
    else
        measured.broken.push_back("the server said nothing of its recording: " + wall.server().output());
    wall.watch(500ms);
    // One that starts on the full disk cannot keep what it fetches, and draws all the same.
    const TimePoint restarted = now();
    wall.host("upper-left").signal(SIGKILL);
    if (!wall.waitForExit(wall.host("upper-left"), 5s)) throw RowBroken("upper-left survived SIGKILL");
    wall.startHost("upper-left");
    (void)wall.waitUntilGone("upper-left", restarted, 10s);
    measured.backMs.push_back(toMilliseconds(wall.waitUntilBack("upper-left", now(), 20s) - restarted));
    measured.missed.push_back(wall.timeline().missed(from, now()));
    wall.conclude(measured, {"upper-left"});
    return measured;
}

Measurement secondServer(const DrillOptions& options) {
    const test::TemporaryFolder files;
    const std::string scene = files.write("scene.tsct", drillScene(options.nodes));
    DrillWall wall({.scene = scene});
    Measurement measured;
    for (int i = 0; i < options.repetitions; ++i) {
        wall.watchUndisturbed(measured, 500ms);
        const TimePoint from = now();
        const auto second = wall.start(
            "second", {test::program("tessera-server"), "--wall", "2x2", "--scene", scene, "--listen", wall.address()});
        if (!wall.waitForExit(*second, 20s)) throw RowBroken("a second server on the port did not end");
        measured.noticedMs.push_back(toMilliseconds(now() - from));
        wall.watch(300ms);
        measured.missed.push_back(wall.timeline().missed(from, now()));
        const std::string said = second->output();
        if (second->waitForExit(0ms) != 4 || said.find(wall.address()) == std::string::npos)
            measured.broken.push_back("the second server said: " + said);
    }
    wall.conclude(measured, {});
    return measured;
}

}  // namespace

std::vector<Row> serverRows() {
    return {
        {.name = "kill-server",
         .deed = "the server killed, started again",
         .promise = {.noticedMs = 1'000, .backMs = 10'000},
         .run = killServer},
        {.name = "stop-server", .deed = "the server stopped for 2 s", .promise = {.backMs = 5'000}, .run = stopServer},
        {.name = "journal",
         .deed = "the server killed, goes on from its journal",
         .promise = {.noticedMs = 1'000, .backMs = 10'000},
         .run = goOnFromJournal},
        {.name = "full-disk",
         .deed = "a full disk below recording and cache",
         .promise = {.missed = 3},
         .run = fillDisk},
        {.name = "second-server", .deed = "a second server on the port", .promise = {.missed = 3}, .run = secondServer},
    };
}

}  // namespace tessera::drill
