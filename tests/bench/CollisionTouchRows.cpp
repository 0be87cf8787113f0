/// any and all.
#include <fmt/format.h>

#include "server/collision/query/TouchQuery.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {

void touchRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table) {
    const TriangleTree a(pair.a), b(pair.b);
    const std::size_t count = pair.poses.size();
    std::vector<std::size_t> ours(count), theirs(count);
    const auto agree = [&](const std::string& what) {
        std::size_t differ = 0;
        std::string first;
        for (std::size_t i = 0; i < count; ++i)
            if (ours[i] != theirs[i] && ++differ == 1)
                first = fmt::format("pose {}: {} here, {} there", i, ours[i], theirs[i]);
        if (differ > 0) table.complain(fmt::format("{}: {} of {} poses, first {}", what, differ, count, first));
    };

    if (options.wants("any")) {
        const auto times = raceInTurns(count, options.passes,
                                       {[&](std::size_t i) {
                                            QueryWork work;
                                            ours[i] = firstTouching(a, b, pair.poses[i], work).touch == Touch::kYes;
                                        },
                                        [&](std::size_t i) { theirs[i] = fcl.obb.any(pair.poses[i]); },
                                        [&](std::size_t i) { theirs[i] = fcl.obbRss.any(pair.poses[i]); }});
        agree("any");
        std::size_t hits = 0;
        for (const std::size_t hit : theirs) hits += hit;
        const Better peer = betterOf("FCL OBB", times[1], "FCL OBBRSS", times[2]);
        table.add({.pair = pair.name,
                   .operation = "any",
                   .peer = peer.name,
                   .ours = summarise(times[0]),
                   .theirs = peer.summary,
                   .atMost = 0.19,
                   .aim = 0.12,
                   .remark = fmt::format("{} of {} touch", hits, count)});
        const Better nearPeer = betterOf("FCL OBB", pick(times[1], pair.near), "FCL OBBRSS", pick(times[2], pair.near));
        if (!pair.near.empty())
            table.add({.pair = pair.name,
                       .operation = "any, near but not touching",
                       .peer = nearPeer.name,
                       .ours = summarise(pick(times[0], pair.near)),
                       .theirs = nearPeer.summary,
                       .atMost = 0.23,
                       .aim = 0.15,
                       .remark = fmt::format("{} poses", pair.near.size())});
    }

    if (options.wants("all")) {
        const auto times = raceInTurns(count, options.passes,
                                       {[&](std::size_t i) {
                                            QueryWork work;
                                            ours[i] = allTouching(a, b, pair.poses[i], work).pairs.size();
                                        },
                                        [&](std::size_t i) { theirs[i] = fcl.obb.all(pair.poses[i]); },
                                        [&](std::size_t i) { theirs[i] = fcl.obbRss.all(pair.poses[i]); }});
        agree("all");
        double pairs = 0;
        for (const std::size_t n : ours) pairs += static_cast<double>(n);
        const Better peer = betterOf("FCL OBB", times[1], "FCL OBBRSS", times[2]);
        table.add({.pair = pair.name,
                   .operation = "all",
                   .peer = peer.name,
                   .ours = summarise(times[0]),
                   .theirs = peer.summary,
                   .atMost = 0.11,
                   .aim = 0.07,
                   .remark = fmt::format("{:.1f} pairs a pose", pairs / static_cast<double>(count))});
    }
}

}  // namespace tessera
