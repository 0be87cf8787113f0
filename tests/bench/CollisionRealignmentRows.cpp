/// The schemes of k-DOP realignment beside each other, by what they do to queries (server/collision/volume/README.md).
#include <fmt/format.h>

#include "server/collision/query/TouchQuery.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {
namespace {

struct Scheme {
    const char* name;
    Realignment realignment;
};
constexpr Scheme kSchemes[] = {{"three planes", Realignment::kThreePlanes},
                               {"axis box", Realignment::kBoxEnclosure},
                               {"table", Realignment::kTable},
                               {"planes in one frame", Realignment::kInOneFrame},
                               {"planes in both frames", Realignment::kInBothFrames}};

void rowsOf(const BenchPair& pair, unsigned k, VolumeKind kind, const BenchOptions& options, CollisionTable& table) {
    const TreeOptions kindOfTree{.volume = kind, .profiles = true};
    const TriangleTree a(pair.a, kindOfTree), b(pair.b, kindOfTree);
    std::vector<std::vector<std::size_t>> answers(std::size(kSchemes), std::vector<std::size_t>(pair.poses.size()));
    std::vector<std::uint64_t> tests(std::size(kSchemes));
    std::vector<Contender> contenders;
    for (std::size_t s = 0; s < std::size(kSchemes); ++s)
        contenders.emplace_back([&, s](std::size_t i) {
            QueryWork work;
            answers[s][i] =
                allTouching(a, b, pair.poses[i], work, {.realignment = kSchemes[s].realignment}).pairs.size();
            tests[s] += work.boxTests;
        });
    const auto times = raceInTurns(pair.poses.size(), options.passes, contenders);
    for (std::size_t s = 1; s < std::size(kSchemes); ++s) {
        if (answers[s] != answers[0]) table.complain(fmt::format("all by realignment, {}", kSchemes[s].name));
        const auto row = [&](const std::string& query, const std::vector<double>& ours,
                             const std::vector<double>& planes) {
            table.add({.pair = pair.name,
                       .operation = fmt::format("{}, {}-DOP, {}", query, k, kSchemes[s].name),
                       .peer = "three planes",
                       .ours = summarise(ours),
                       .theirs = summarise(planes),
                       .remark = fmt::format("{:.2f} x the node tests",
                                             static_cast<double>(tests[s]) / static_cast<double>(tests[0]))});
        };
        row("all", times[s], times[0]);
        if (!pair.near.empty()) row("all near", pick(times[s], pair.near), pick(times[0], pair.near));
    }
}

}  // namespace

void realignmentRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    rowsOf(pair, 14, VolumeKind::kDop14, options, table);
    rowsOf(pair, 18, VolumeKind::kDop18, options, table);
    rowsOf(pair, 26, VolumeKind::kDop26, options, table);
}

}  // namespace tessera
