/// Time of impact, beside conservative advancement over FCL's distance: what a user of FCL writes whose own continuous
/// queries miss contacts (shared/design/collision.md, section 7).
#include <fmt/format.h>

#include <cmath>

#include "server/collision/query/TimeOfImpact.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {

namespace {

constexpr double kTolerance = 1e-4;

struct Advance {
    bool hit = false;
    double t = 1;
    int queries = 0;
};

/// t += d / (|v| + ω r) until d is within the tolerance (Mirtich 1996). `reach`: how far B's farthest vertex is from
/// the origin that it turns about.
Advance advance(const FclPair& fcl, const BodyMotion& motion, double reach) {
    const double speed = (motion.end.translation - motion.start.translation).norm() +
                         motion.start.rotation.angularDistance(motion.end.rotation) * reach;
    Advance out;
    double t = 0;
    while (true) {
        const double d = fcl.distance(motion.at(t).matrix());
        ++out.queries;
        if (d <= kTolerance) return {true, t, out.queries};
        if (!(speed > 0)) return out;
        t += d / speed;
        if (t > 1) return out;
    }
}

double reachOf(const TriangleMesh& mesh) {
    double reach = 0;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
        for (unsigned i = 0; i < 3; ++i) reach = std::max(reach, mesh.corner(f, i).norm());
    return reach;
}

}  // namespace

void impactRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table) {
    const TriangleTree a(pair.a), b(pair.b);
    const std::size_t count = pair.motions.size();
    if (count == 0) return;
    const double reach = reachOf(pair.b);
    std::vector<Impact> ours(count);
    std::vector<Advance> theirs(count);
    const auto times =
        raceInTurns(count, options.passes,
                    {[&](std::size_t i) {
                         QueryWork work;
                         ours[i] = timeOfImpact(a, BodyMotion{}, b, pair.motions[i], work, {.tolerance = kTolerance});
                     },
                     [&](std::size_t i) { theirs[i] = advance(fcl.obbRss, pair.motions[i], reach); }});
    // Both stop within the tolerance before the first contact, not at the same t. A motion that only comes near may be
    // a hit for one and none for the other.
    std::size_t hits = 0, onlyOne = 0;
    double queries = 0, apart = 0;
    for (std::size_t i = 0; i < count; ++i) {
        hits += ours[i].hit;
        onlyOne += ours[i].hit != theirs[i].hit;
        queries += theirs[i].queries;
        if (ours[i].hit && theirs[i].hit) apart = std::max(apart, std::abs(ours[i].t - theirs[i].t));
        if (ours[i].hit && !(ours[i].distance <= kTolerance))
            table.complain(fmt::format("toi: motion {}: distance {:.3g} at t", i, ours[i].distance));
    }
    if (onlyOne > 0) table.complain(fmt::format("toi: {} of {} motions are a hit for one alone", onlyOne, count));
    table.add({.pair = pair.name,
               .operation = "toi, tolerance 1e-4",
               .peer = "advancement over FCL OBBRSS",
               .ours = summarise(times[0]),
               .theirs = summarise(times[1]),
               .atMost = 0.20,
               .aim = 0.10,
               .remark = fmt::format("{} of {} hit, t at most {:.1e} apart, {:.1f} distances a motion there", hits,
                                     count, apart, queries / static_cast<double>(count))});
}

}  // namespace tessera
