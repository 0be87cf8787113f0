#include <fmt/format.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/SceneRows.h"
#include "tests/bench/SceneTree.h"
#include "tests/bench/SideProcess.h"

namespace tessera::bench {
namespace {

struct Answer {
    explicit Answer(const std::vector<double>& numbers) : taken(numbers[0]), sum(numbers[1]), saying(numbers[2]) {}
    double taken, sum, saying;
};

struct Taken {
    std::vector<double> ours, theirs;
};

}  // namespace

void treeRows(SceneTable& table, const SceneOptions& options) {
    table.begin(fmt::format("{} nodes, ten below each, {} changed", options.many, changedCount(options.many)));
    const std::string peer = std::filesystem::path(options.program).parent_path() / "bench_scene_osg";
    const bool both = std::filesystem::exists(peer);
    if (!both)
        table.skip(
            "OpenSceneGraph was not found when this was configured; ./deploy/set-up --peers installs it. Our own "
            "figures stand alone");

    std::signal(SIGPIPE, SIG_IGN);  // a side that cannot start is told by its silence
    std::map<std::string, Taken> taken;
    const int rounds = options.quick ? 1 : 5;
    const int repeats = options.quick ? 1 : 5;
    for (int round = 0; round < rounds; ++round) {
        // A process for each round: what an earlier build left in malloc's lists serves nobody.
        SideProcess ours({options.program, "--tree-side", std::to_string(options.many)});
        std::optional<SideProcess> theirs;
        if (both) theirs.emplace(std::vector<std::string>{peer, std::to_string(options.many)});
        const auto ask = [&](const char* what, bool counts = true) {
            const Answer our(ours.ask(what, 3));
            if (counts) taken[what].ours.push_back(our.taken);
            if (counts) taken[what + std::string(" list")].ours.push_back(our.saying);
            if (!theirs) return;
            const Answer their(theirs->ask(what, 3));
            if (counts) taken[what].theirs.push_back(their.taken);
            if (std::abs(our.sum - their.sum) > 1e-9 * std::abs(their.sum))
                table.complain(fmt::format("{}: the sums of all world translations are {:.17g} and {:.17g}", what,
                                           our.sum, their.sum));
        };
        ask("build");
        ask("memory");
        for (const char* what : {"traverse", "change", "change-traverse", "change-look"}) {
            ask(what, false);
            for (int i = 0; i < repeats; ++i) ask(what);
        }
        (void)ours.ask("change-kept", 3);  // the first one makes what is kept
        for (int i = 0; i < repeats; ++i) taken["change-kept"].ours.push_back(ours.ask("change-kept", 3)[0]);
    }
    // OpenSceneGraph keeps no world matrices: the frame's traversal is what it has to set against those that we keep.
    taken["change-kept"].theirs = taken["change-traverse"].theirs;
    const auto row = [&](const char* what, const std::string& operation, double atMost, double factor,
                         const std::string& unit, const std::string& remark = "") {
        table.add({.operation = operation,
                   .peer = taken[what].theirs.empty() ? "-" : "OpenSceneGraph 3.6.5",
                   .ours = medianOf(taken[what].ours, factor),
                   .theirs = medianOf(taken[what].theirs, factor),
                   .unit = unit,
                   .atMost = both ? atMost : 0,
                   .remark = remark});
    };
    row("build", "build", 0.5, 1e3, "ms", "ours: a list said and applied, with its hash");
    row("build list", "  of that: the list said", 0, 1e3, "ms");
    row("traverse", "traverse: each node's world matrix", 0.5, 1e3, "ms",
        "Action; a NodeVisitor with a stack of matrices");
    row("change-traverse", "change a tenth, then traverse", 0.5, 1e3, "ms");
    row("change", "  of that: the change alone", 0, 1e3, "ms", "ours: said, checked, applied, hashed");
    row("change list", "  of that: the list said", 0, 1e3, "ms");
    row("change-look", "change a tenth, world matrices of those", 0.5, 1e3, "ms",
        "ours: WorldTransforms; theirs: each walks up to the root");
    row("change-kept", "change a tenth, kept world matrices", 0.5, 1e3, "ms",
        "ours: Aspect and RenderScene; theirs: change, traverse");
    row("memory", "memory per node", 0.7, 1.0 / static_cast<double>(options.many), "bytes", "as malloc counts");
}

}  // namespace tessera::bench
