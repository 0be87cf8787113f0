/// Rows about applications: one that loads a large file, eight that ask without end.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>

#include <algorithm>

#include "tests/drill/DrillWall.h"
#include "tests/drill/Rows.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

std::uint64_t loadedNodes(const DrillOptions& options) {
    return options.large ? 1'000'000 : options.nodes;
}

Measurement loadFile(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(1'000)), .server = {"--allow", files.path()}});
    const std::string large = files.write("large.tsct", drillScene(loadedNodes(options), false));
    Measurement measured;
    wall.watchUndisturbed(measured, 2s);
    const std::uint64_t before = wall.networkBytes();
    const TimePoint from = now();
    const auto load = wall.start("load", {test::program("tessera-ctl"), "--server", wall.address(), "load", large});
    if (!wall.waitForExit(*load, 180s)) throw RowBroken("the load did not end");
    measured.backMs.push_back(toMilliseconds(now() - from));
    if (load->waitForExit(0ms) != 0) measured.broken.push_back("the load failed: " + load->output());
    wall.watch(500ms);
    measured.missed.push_back(wall.timeline().missed(from, now()));
    measured.bytes = wall.networkBytes() - before;
    wall.conclude(measured, {});
    return measured;
}

constexpr double kSlower = 1.2;
constexpr int kTurns = 5;
constexpr auto kTurn = 2s;

Measurement askWithoutEnd(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    // In turns, and the median of the turns: the machine is shared.
    std::vector<double> alone, beside;
    std::uint64_t answered = 0;
    for (int turn = 0; turn < kTurns; ++turn) {
        TimePoint from = now();
        wall.watchUndisturbed(measured, kTurn);
        alone.push_back(quantile(wall.timeline().intervalsMs(from, now()), 0.99));

        // Hosts that draw nothing have no pictures to give: those questions cost the server all the same, and are
        // answered after its deadline, which is longer than a turn.
        const std::vector<std::string> kinds = {"status", "status", "tree",   "tree",
                                                "picks",  "picks",  "images", "images"};
        std::vector<std::unique_ptr<test::Process>> guests;
        for (const std::string& kind : kinds) guests.push_back(wall.startGuest(kind, true));
        wall.watch(500ms);  // programs start
        from = now();
        const std::uint64_t before = wall.networkBytes();
        wall.watch(kTurn);
        beside.push_back(quantile(wall.timeline().intervalsMs(from, now()), 0.99));
        measured.missed.push_back(wall.timeline().missed(from, now()));
        measured.bytes = wall.networkBytes() - before;
        for (const auto& guest : guests) guest->signal(SIGTERM);
        for (std::size_t i = 0; i < kinds.size(); ++i) {
            const std::uint64_t count = std::stoull(guests[i]->waitForText("answered ", 10s).value_or("0"));
            if (count == 0 && kinds[i] != "images") measured.broken.push_back("nobody was answered about " + kinds[i]);
            answered += count;
        }
        guests.clear();
        wall.watch(300ms);
    }
    const double p99Alone = quantile(alone, 0.5), p99Beside = quantile(beside, 0.5);
    measured.remark = fmt::format("p99 of a frame {:.1f} ms, alone {:.1f}; {} answers", p99Beside, p99Alone, answered);
    if (p99Beside > kSlower * p99Alone)
        measured.broken.push_back(fmt::format("p99 of a frame rises by more than 20 %, in turns {:.1f}, alone {:.1f}",
                                              fmt::join(beside, " "), fmt::join(alone, " ")));
    wall.conclude(measured, {});
    return measured;
}

}  // namespace

std::vector<Row> applicationRows(const DrillOptions& options) {
    // The frame that shows it costs what it shows; those before it are measured by bench_load.
    const double hundredThousands = std::max(1.0, 1e-5 * static_cast<double>(loadedNodes(options)));
    return {
        {.name = "load",
         .deed = "a large file loaded, the frame that shows it included",
         .promise = {.missed = 15 * hundredThousands, .backMs = 180'000},
         .run = loadFile},
        {.name = "askers", .deed = "8 applications at nice 19 ask without end", .promise = {}, .run = askWithoutEnd},
    };
}

}  // namespace tessera::drill
