/// Contacts with points and normals.
#include <fmt/format.h>

#include "server/collision/query/ContactQuery.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {

void contactRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table) {
    const TriangleTree a(pair.a), b(pair.b);
    const std::size_t count = pair.poses.size();
    std::vector<char> ours(count), theirs(count);
    // FCL with contacts on uses another triangle test and gives up to two points a pair, so only yes and no can agree.
    const auto times = raceInTurns(count, options.passes,
                                   {[&](std::size_t i) {
                                        QueryWork work;
                                        ours[i] = !contactsBetween(a, b, pair.poses[i], work).contacts.empty();
                                    },
                                    [&](std::size_t i) { theirs[i] = fcl.obb.contacts(pair.poses[i]) > 0; },
                                    [&](std::size_t i) { theirs[i] = fcl.obbRss.contacts(pair.poses[i]) > 0; }});
    std::size_t differ = 0;
    for (std::size_t i = 0; i < count; ++i) differ += ours[i] != theirs[i];
    const Better peer = betterOf("FCL OBB, contacts on", times[1], "FCL OBBRSS, contacts on", times[2]);
    table.add({.pair = pair.name,
               .operation = "contacts with points and normals",
               .peer = peer.name,
               .ours = summarise(times[0]),
               .theirs = peer.summary,
               .atMost = 0.15,
               .aim = 0.08,
               .remark = differ > 0 ? fmt::format("FCL's other triangle test says otherwise for {} poses", differ)
                                    : std::string()});
}

}  // namespace tessera
