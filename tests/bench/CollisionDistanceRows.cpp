/// Distance, cold and along coherent motions.
#include <fmt/format.h>

#include <cmath>

#include "server/collision/query/DistanceQuery.h"
#include "tests/bench/CollisionRows.h"

namespace tessera {

namespace {

/// Frames per motion of the warm row.
constexpr std::size_t kFrames = 50;

/// B on its way to A, in even steps from the start of each motion to within a thousandth of A.
std::vector<Affine3d> approach(const TriangleTree& a, const TriangleTree& b, const std::vector<BodyMotion>& motions) {
    std::vector<Affine3d> frames;
    const double reach = b.mesh().bounds().lower.cwiseAbs().cwiseMax(b.mesh().bounds().upper.cwiseAbs()).norm();
    for (std::size_t m = 0; m < std::min<std::size_t>(motions.size(), 20); ++m) {
        const BodyMotion& motion = motions[m];
        const double speed = (motion.end.translation - motion.start.translation).norm() +
                             motion.start.rotation.angularDistance(motion.end.rotation) * reach;
        double last = 0;
        for (int step = 0; step < 100 && last < 1; ++step) {
            QueryWork work;
            const double free = distanceBetween(a, b, motion.at(last).matrix(), work).distance;
            if (free < 1e-3 || speed <= 0) break;
            last = std::min(1.0, last + free / speed);
        }
        for (std::size_t f = 0; f < kFrames; ++f)
            frames.push_back(motion.at(last * static_cast<double>(f) / (kFrames - 1)).matrix());
    }
    return frames;
}

/// Both measure to rounding; the difference is said, and one beyond a millionth of the size is a complaint.
std::string compare(const std::vector<double>& ours, const std::vector<double>& theirs, const std::string& what,
                    double size, CollisionTable& table) {
    double most = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
        const double off = std::abs(ours[i] - theirs[i]);
        if (!(off <= 1e-6 * size))
            table.complain(fmt::format("{}: pose {}: {:.17g} here, {:.17g} there", what, i, ours[i], theirs[i]));
        most = std::max(most, off);
    }
    return fmt::format("at most {:.1e} apart", most);
}

}  // namespace

void distanceRows(const BenchPair& pair, const FclPairs& fcl, const BenchOptions& options, CollisionTable& table) {
    const TriangleTree a(pair.a), b(pair.b);
    const double size = pair.a.bounds().size().norm();
    {
        std::vector<double> ours(pair.poses.size()), theirs(pair.poses.size());
        const auto times = raceInTurns(pair.poses.size(), options.passes,
                                       {[&](std::size_t i) {
                                            QueryWork work;
                                            ours[i] = distanceBetween(a, b, pair.poses[i], work).distance;
                                        },
                                        [&](std::size_t i) { theirs[i] = fcl.obbRss.distance(pair.poses[i]); }});
        table.add({.pair = pair.name,
                   .operation = "distance, cold",
                   .peer = "FCL OBBRSS",
                   .ours = summarise(times[0]),
                   .theirs = summarise(times[1]),
                   .atMost = 0.26,
                   .aim = 0.16,
                   .remark = compare(ours, theirs, "distance, cold", size, table)});
    }
    const std::vector<Affine3d> frames = approach(a, b, pair.motions);
    if (frames.empty()) return;
    std::vector<double> ours(frames.size()), theirs(frames.size());
    DistanceOptions warm;
    const auto times = raceInTurns(frames.size(), options.passes,
                                   {[&](std::size_t i) {
                                        if (i % kFrames == 0) warm.start.reset();
                                        QueryWork work;
                                        const Distance d = distanceBetween(a, b, frames[i], work, warm);
                                        ours[i] = d.distance;
                                        warm.start = d.faces;
                                    },
                                    [&](std::size_t i) { theirs[i] = fcl.obbRss.distance(frames[i]); }});
    table.add({.pair = pair.name,
               .operation = "distance, warm, coherent motion",
               .peer = "FCL OBBRSS",
               .ours = summarise(times[0]),
               .theirs = summarise(times[1]),
               .atMost = 0.05,
               .aim = 0.03,
               .remark = fmt::format("{} motions of {} frames, {}", frames.size() / kFrames, kFrames,
                                     compare(ours, theirs, "distance, warm", size, table))});
}

}  // namespace tessera
