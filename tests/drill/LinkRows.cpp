/// Rows about cables: each host on a machine of its own, in network namespaces.
#include <fmt/format.h>
#include <signal.h>

#include "tests/drill/DrillWall.h"
#include "tests/drill/Rows.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kAffected = 3;
const std::string& affected() {
    return kFourHosts[kAffected];
}

DrillWallOptions onMachines(const test::TemporaryFolder& files, std::uint64_t nodes) {
    return {.scene = files.write("scene.tsct", drillScene(nodes)), .machines = kFourHosts.size()};
}

/// Something is wrong with a host's cable for 5 s; meanwhile the others go on.
Measurement disturb(const DrillOptions& options, void (SwitchedNetwork::*how)(std::size_t)) {
    const test::TemporaryFolder files;
    DrillWall wall(onMachines(files, options.nodes));
    Measurement measured;
    wall.watchUndisturbed(measured, 1s);
    const std::uint64_t before = wall.networkBytes();
    const TimePoint from = now();
    (wall.network().*how)(kAffected);
    measured.noticedMs.push_back(toMilliseconds(wall.waitUntilGone(affected(), from, 10s) - from));
    wall.watch(5s - (now() - from));
    const TimePoint healed = now();
    wall.network().heal(kAffected);
    measured.backMs.push_back(toMilliseconds(wall.waitUntilBack(affected(), healed, 30s) - healed));
    wall.watch(300ms);
    measured.missed.push_back(wall.timeline().missed(from, now()));
    measured.bytes = wall.networkBytes() - before;
    wall.conclude(measured, {affected()});
    return measured;
}

/// A host dies behind a cable that is cut: nobody tells the server. It starts again while its old connection still
/// seems to be open.
Measurement leaveHalfOpen(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall(onMachines(files, options.nodes));
    Measurement measured;
    measured.bytes = 0;
    for (int i = 0; i < options.repetitions; ++i) {
        wall.watchUndisturbed(measured, 1s);
        const std::uint64_t before = wall.networkBytes();
        const TimePoint from = now();
        wall.network().cut(kAffected);
        wall.host(affected()).signal(SIGKILL);
        if (!wall.waitForExit(wall.host(affected()), 5s)) throw RowBroken("a host survived SIGKILL");
        wall.network().heal(kAffected);
        const TimePoint started = now();
        wall.startHost(affected());
        measured.noticedMs.push_back(toMilliseconds(wall.waitUntilGone(affected(), from, 10s) - from));
        const TimePoint gone = now();
        measured.backMs.push_back(toMilliseconds(wall.waitUntilBack(affected(), gone, 20s) - started));
        wall.watch(300ms);
        measured.missed.push_back(wall.timeline().missed(from, now()));
        *measured.bytes += (wall.networkBytes() - before) / static_cast<std::uint64_t>(options.repetitions);
    }
    wall.conclude(measured, {affected()});
    return measured;
}

Measurement losePackets(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall(onMachines(files, options.nodes));
    Measurement measured;
    wall.watchUndisturbed(measured, 1s);
    const std::uint64_t before = wall.networkBytes();
    wall.network().lose(kAffected, 1);
    const TimePoint from = now();
    for (int second = 0; second < 8; ++second) {
        const TimePoint began = now();
        wall.watch(1s);
        measured.missed.push_back(wall.timeline().missed(began, now()));
    }
    const std::vector<double> intervals = wall.timeline().intervalsMs(from, now());
    measured.bytes = wall.networkBytes() - before;
    measured.remark = fmt::format("{:.1f} frames a second", static_cast<double>(intervals.size()) / 8);
    wall.network().heal(kAffected);
    wall.conclude(measured, {});
    return measured;
}

/// A host fetches the scene over a thin line while the others go on.
Measurement joinSlowly(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall(onMachines(files, options.large ? 1'000'000 : options.nodes));
    Measurement measured;
    wall.host(affected()).signal(SIGKILL);
    (void)wall.waitUntilGone(affected(), now(), 10s);
    if (!wall.waitForExit(wall.host(affected()), 5s)) throw RowBroken("a host survived SIGKILL");
    wall.network().limitRate(kAffected, "10mbit");
    wall.watchUndisturbed(measured, 2s);
    const std::uint64_t before = wall.networkBytes();
    const TimePoint from = now();
    wall.startHost(affected());
    measured.backMs.push_back(toMilliseconds(wall.waitUntilBack(affected(), from, 300s) - from));
    measured.missed.push_back(wall.timeline().missed(from, now()));
    measured.bytes = wall.networkBytes() - before;
    wall.conclude(measured, {affected()});
    return measured;
}

}  // namespace

std::vector<Row> linkRows() {
    return {
        {.name = "cut-cable",
         .deed = "a host's cable cut for 5 s",
         .promise = {.missed = 60, .noticedMs = 1'000, .backMs = 10'000},
         .run = [](const DrillOptions& options) { return disturb(options, &SwitchedNetwork::cut); }},
        {.name = "one-way-link",
         .deed = "a link that carries one way only, for 5 s",
         .promise = {.missed = 60, .noticedMs = 1'000, .backMs = 10'000},
         .run = [](const DrillOptions& options) { return disturb(options, &SwitchedNetwork::mute); }},
        {.name = "half-open",
         .deed = "a host dies unheard, starts again",
         .promise = {.missed = 60, .noticedMs = 1'000, .backMs = 10'000},
         .run = leaveHalfOpen},
        {.name = "packet-loss",
         .deed = "1 % of a host's packets lost, 8 s",
         .promise = {.missed = 30},
         .run = losePackets},
        {.name = "thin-line",
         .deed = "a host joins over 10 Mbit/s",
         .promise = {.missed = 3, .backMs = 300'000},
         .run = joinSlowly},
    };
}

}  // namespace tessera::drill
