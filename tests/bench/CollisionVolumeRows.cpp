/// Realigned 18-DOPs beside our own axis-aligned and oriented boxes; two threads beside one.
#include <fmt/format.h>

#include "common/base/Workers.h"
#include "server/collision/query/TouchQuery.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {

namespace {

struct Trees {
    Trees(const BenchPair& pair, VolumeKind kind) : a(pair.a, {.volume = kind}), b(pair.b, {.volume = kind}) {}
    TriangleTree a, b;
};

}  // namespace

void volumeRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    const Trees dop(pair, VolumeKind::kDop18), aabb(pair, VolumeKind::kAabb), obb(pair, VolumeKind::kObb);
    const std::size_t count = pair.poses.size();
    std::vector<std::vector<std::size_t>> answers(3, std::vector<std::size_t>(count));
    const auto contenders = [&](auto&& query) {
        std::vector<Contender> out;
        for (std::size_t c = 0; c < 3; ++c)
            out.emplace_back([&, c, query](std::size_t i) {
                const Trees& trees = c == 0 ? dop : c == 1 ? aabb : obb;
                answers[c][i] = query(trees, pair.poses[i]);
            });
        return out;
    };
    const auto add = [&](const std::string& operation, const std::vector<std::vector<double>>& times) {
        if (answers[0] != answers[1] || answers[0] != answers[2]) table.complain(operation + " by kind of volume");
        const auto row = [&](const std::string& name, const std::vector<std::size_t>* subset) {
            const auto of = [&](std::size_t c) { return subset ? pick(times[c], *subset) : times[c]; };
            const Better peer = betterOf("own AABB", of(1), "own OBB", of(2));
            table.add({.pair = pair.name,
                       .operation = name,
                       .peer = peer.name,
                       .ours = summarise(of(0)),
                       .theirs = peer.summary,
                       .atMost = 1.0,
                       .aim = 0.7,
                       .remark = fmt::format("AABB {:.2f}, OBB {:.2f}", summarise(of(1)).mean, summarise(of(2)).mean)});
        };
        row(operation + ", 18-DOP", nullptr);
        if (!pair.near.empty()) row(operation + ", 18-DOP, near", &pair.near);
    };
    add("any", raceInTurns(count, options.passes, contenders([](const Trees& t, const Affine3d& a_T_b) {
                               QueryWork work;
                               return static_cast<std::size_t>(firstTouching(t.a, t.b, a_T_b, work).touch);
                           })));
    add("all", raceInTurns(count, options.passes, contenders([](const Trees& t, const Affine3d& a_T_b) {
                               QueryWork work;
                               return allTouching(t.a, t.b, a_T_b, work).pairs.size();
                           })));
}

void threadRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    const TriangleTree a(pair.a), b(pair.b);
    Workers two(2);
    std::vector<std::vector<FacePair>> one(pair.poses.size()), shared(pair.poses.size());
    const auto times = raceInTurns(pair.poses.size(), options.passes,
                                   {[&](std::size_t i) {
                                        QueryWork work;
                                        shared[i] = allTouching(a, b, pair.poses[i], work, {.workers = &two}).pairs;
                                    },
                                    [&](std::size_t i) {
                                        QueryWork work;
                                        one[i] = allTouching(a, b, pair.poses[i], work).pairs;
                                    }},
                                   Clock::kWall);
    if (one != shared) table.complain("all by number of threads");
    table.add({.pair = pair.name,
               .operation = "all, two threads",
               .peer = "one thread",
               .ours = summarise(times[0]),
               .theirs = summarise(times[1]),
               .atMost = 0.56,
               .aim = 0.52,
               .remark = "wall time"});
}

}  // namespace tessera
