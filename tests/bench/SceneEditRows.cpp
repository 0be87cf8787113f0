#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/SceneRows.h"
#include "tests/bench/SceneStage.h"

namespace tessera::bench {
namespace {

constexpr std::uint64_t kSmall = 1'000, kLarge = 100'000;

/// Seconds of each repetition, by half of the pair, in the small and the large scene.
struct PairTimes {
    using Halves = std::array<std::vector<double>, 2>;
    Halves server[2], client[2];
};

bool within(std::chrono::steady_clock::time_point start, double seconds) {
    return std::chrono::steady_clock::now() - start < std::chrono::duration<double>(seconds);
}

/// The two scenes, and server and host, take turns, a few edits each: the first pair finds in the caches what others
/// have left there, and does not count. What is dear is repeated less often, but never less than a median needs.
PairTimes measure(const EditKind& kind, SceneStage& small, SceneStage& large, bool quick) {
    PairTimes times;
    SceneStage* stages[] = {&small, &large};
    const std::size_t least = quick ? 1 : 4, most = quick ? 4 : 150;
    std::size_t turn = 0, atOnce = 4;
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t round = 0; round < most && (round < least || within(start, quick ? 0.2 : 3)); ++round) {
        const auto began = std::chrono::steady_clock::now();
        for (int size = 0; size < 2; ++size) {
            const auto pairs = [&](PairTimes::Halves& halves, const auto& seconds) {
                for (std::size_t i = 0; i < atOnce; ++i)
                    for (const bool second : {false, true}) {
                        const double taken = seconds(turn + i, second);
                        if (i > 0) halves[second].push_back(taken);
                    }
            };
            pairs(times.server[size],
                  [&](std::size_t at, bool second) { return stages[size]->edit(kind, at, second); });
            pairs(times.client[size], [&](std::size_t, bool) { return stages[size]->follow(); });
        }
        turn += atOnce;
        // What costs next to nothing is measured all the more often.
        if (within(began, 0.01)) atOnce = 16;
    }
    return times;
}

std::vector<double> meanOfBoth(const PairTimes::Halves& halves) {
    std::vector<double> means;
    for (std::size_t i = 0; i < halves[0].size(); ++i) means.push_back((halves[0][i] + halves[1][i]) / 2);
    return means;
}

void shapeRows(SceneTable& table, const SceneOptions& options, SceneShape shape, const std::string& what) {
    const auto wanted = [&](const EditKind& kind) {
        return (kind.first + kind.second).find(options.only) != std::string::npos;
    };
    if (std::ranges::none_of(editKinds(shape), wanted)) return;
    table.begin(what);
    SceneStage small(shape, kSmall), large(shape, kLarge);
    for (const EditKind& kind : editKinds(shape)) {
        if (!wanted(kind)) continue;
        const PairTimes times = measure(kind, small, large, options.quick);
        const auto row = [&](const std::string& name, const PairTimes::Halves* of, int half) {
            const auto ofSize = [&](int size) {
                return medianOf(half < 0 ? meanOfBoth(of[size]) : of[size][static_cast<std::size_t>(half)], 1e6);
            };
            table.add({.operation = name,
                       .peer = fmt::format("{} instead of {}", kLarge, kSmall),
                       .ours = ofSize(1),
                       .theirs = ofSize(0),
                       .unit = "µs",
                       .atMost = 2});
        };
        const auto both = [&](const std::string& name, int half) {
            row(name + ": server", times.server, half);
            row(name + ": client", times.client, half);
        };
        both(kind.first, kind.second.empty() ? -1 : 0);
        if (!kind.second.empty()) both(kind.second, 1);
    }
}

}  // namespace

void editRows(SceneTable& table, const SceneOptions& options) {
    shapeRows(table, options, SceneShape::kBushy, "one edit a frame, ten nodes below each");
    shapeRows(table, options, SceneShape::kWide, "one edit a frame, all children of one node");
    shapeRows(table, options, SceneShape::kChains, "one edit a frame, chains down to the depth limit");
}

void idleRows(SceneTable& table, const SceneOptions& options) {
    table.begin("a frame of the server without any change: simulation and view");
    SceneStage small(SceneShape::kBushy, kSmall);
    for (const std::uint64_t size : {kLarge, options.many}) {
        SceneStage large(SceneShape::kBushy, size);
        const std::size_t least = options.quick ? 3 : 9, most = options.quick ? 20 : 2000;
        std::vector<double> ours, theirs;
        const auto start = std::chrono::steady_clock::now();
        for (std::size_t turn = 0; turn < most && (turn < least || within(start, options.quick ? 0.5 : 5)); ++turn) {
            // Ten frames each, so that what the other one left in the caches counts as little as in a running wall.
            double our = 0, their = 0;
            for (int i = 0; i < 10; ++i) their += small.idle() / 10;
            for (int i = 0; i < 10; ++i) our += large.idle() / 10;
            ours.push_back(our);
            theirs.push_back(their);
        }
        table.add({.operation = fmt::format("idle, {} nodes", size),
                   .peer = fmt::format("{} nodes", kSmall),
                   .ours = medianOf(std::move(ours), 1e6),
                   .theirs = medianOf(std::move(theirs), 1e6),
                   .unit = "µs",
                   .atMost = 1.2});
    }
}

}  // namespace tessera::bench
