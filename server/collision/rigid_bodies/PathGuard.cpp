#include "server/collision/rigid_bodies/PathGuard.h"

#include <algorithm>
#include <functional>
#include <iterator>

#include "common/base/Workers.h"

namespace tessera::rigid {

namespace {

constexpr std::size_t kSweepsPerTask = 64;
/// A cut that leaves less than this of a way leaves nothing. After so many rounds every cut does.
constexpr double kLeastShare = 1e-3;
constexpr double kUnknown = -1;
constexpr int kSoftRounds = 5, kMostRounds = 200;

}  // namespace

std::vector<PathGuard::Hit> PathGuard::find(const FrameBodies& frame, const NarrowPhase& narrow,
                                            std::span<const FrameEncounter> encounters, std::span<const BodyPath> paths,
                                            const std::vector<bool>& changed, std::uint64_t maxTests, Workers* workers,
                                            bool wantPoints) {
    const std::size_t count = (encounters.size() + kSweepsPerTask - 1) / kSweepsPerTask;
    if (tasks_.size() < count) tasks_.resize(count);
    // Most encounters are of bodies that cannot come near each other in the frame.
    turning_.resize(frame.parts.size());
    strayed_.assign(frame.parts.size(), 0);
    const bool first = before_.empty();
    if (first) room_.assign(encounters.size(), kUnknown);
    for (std::size_t p = 0; p < frame.parts.size(); ++p) {
        const FramePart& part = frame.parts[p];
        if (part.body == kNoBody || part.surface == nullptr || !changed[part.body]) continue;
        const PlacedSolid& solid = narrow.solid(static_cast<std::uint32_t>(p));
        const SweptPart swept{&paths[part.body], &part, solid.shape != nullptr ? &solid : nullptr, 0};
        turning_[p] = turningOf(swept);
        if (!first) strayed_[p] = swept.path->strayedFrom(before_[part.body], farthestOf(swept));
    }
    before_.assign(paths.begin(), paths.end());
    const auto task = [&](std::size_t t) {
        Task& own = tasks_[t];
        own.hits.clear();
        for (std::size_t i = t * kSweepsPerTask; i < std::min(encounters.size(), (t + 1) * kSweepsPerTask); ++i) {
            const FrameEncounter& e = encounters[i];
            const FramePart &a = frame.parts[e.partA], &b = frame.parts[e.partB];
            if (!e.known || !(changed[a.body] || changed[b.body])) continue;
            room_[i] -= strayed_[e.partA] + strayed_[e.partB];
            if (room_[i] > 0) continue;
            room_[i] = kUnknown;
            const double way =
                (paths[a.body].moved - paths[b.body].moved).norm() + turning_[e.partA] + turning_[e.partB];
            if (way <= e.parted.gap) {
                room_[i] = e.parted.gap - way;
                continue;
            }
            const PlacedSolid &solidA = narrow.solid(e.partA), &solidB = narrow.solid(e.partB);
            const FrameBody &bodyA = frame.bodies[a.body], &bodyB = frame.bodies[b.body];
            const SweptPart sweptA{&paths[a.body], &a, solidA.shape != nullptr ? &solidA : nullptr, bodyA.size};
            const SweptPart sweptB{&paths[b.body], &b, solidB.shape != nullptr ? &solidB : nullptr, bodyB.size};
            const KnownGap known{e.parted.gap,
                                 e.parted.normal,
                                 e.slack,
                                 e.nearest,
                                 narrow.facesOf(e),
                                 narrow.pointsOf(e),
                                 narrow.slopOf(bodyA, bodyB)};
            QueryWork some;
            some.limit = maxTests;
            SweepHit hit = sweep(sweptA, sweptB, known, own.scratch, some, wantPoints);
            if (!hit.hit) room_[i] = hit.room;
            if (hit.hit) own.hits.push_back({static_cast<std::uint32_t>(i), std::move(hit)});
        }
    };
    if (workers == nullptr || count < 2) {
        for (std::size_t t = 0; t < count; ++t) task(t);
    } else {
        workers->run(count, std::cref(task));
    }
    std::vector<Hit> out;
    for (std::size_t t = 0; t < count; ++t) {
        std::move(tasks_[t].hits.begin(), tasks_[t].hits.end(), std::back_inserter(out));
    }
    return out;
}

void PathGuard::cut(const FrameBodies& frame, const NarrowPhase& narrow, std::span<const FrameEncounter> encounters,
                    std::vector<Hit> hits, std::span<BodyPath> paths, const std::vector<bool>& moves,
                    std::uint64_t maxTests, Workers* workers) {
    // By whom a body is carried; those that are squeezed stay where they are, whatever moves over them.
    std::vector<std::uint32_t> carrier(paths.size(), kNoBody);
    std::vector<bool> squeezed(paths.size(), false);
    for (int round = 0; round < kMostRounds && !hits.empty(); ++round) {
        std::vector<double> share(paths.size(), 1);
        std::vector<bool> changed(paths.size(), false);
        const auto carry = [&](std::uint32_t body, std::uint32_t by) {
            if (squeezed[body] || carrier[body] == by) return;
            changed[body] = true;
            if (carrier[body] != kNoBody) {
                squeezed[body] = true;
                paths[body].cut(0);
                return;
            }
            carrier[body] = by;
            const BodyPath& with = paths[by];
            const Vec3d centre = paths[body].centre;
            paths[body] = BodyPath(centre, with.at(1) * centre - centre, with.turned);
        };
        for (const Hit& hit : hits) {
            const FrameEncounter& e = encounters[hit.encounter];
            const std::uint32_t a = frame.parts[e.partA].body, b = frame.parts[e.partB].body;
            for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)}) {
                if (!moves[one] || squeezed[one] || carrier[one] == other) continue;
                const std::uint32_t by = moves[other] ? carrier[other] : other;
                if (carrier[one] != kNoBody) {
                    // Against what moves on its own, it is the other one's turn to give way.
                    if (moves[other] && !squeezed[other]) continue;
                    squeezed[one] = changed[one] = true;
                    paths[one].cut(0);
                } else if (by != kNoBody && !paths[by].still()) {
                    // First as far as it may go alone; if that is no way, along with what pushes it.
                    if (paths[one].still() || hit.found.t < kLeastShare || round >= kSoftRounds)
                        carry(one, by);
                    else
                        share[one] = std::min(share[one], hit.found.t);
                } else if (!paths[one].still()) {
                    share[one] = std::min(share[one], hit.found.t);
                }
            }
        }
        for (std::size_t i = 0; i < paths.size(); ++i) {
            if (share[i] >= 1 || carrier[i] != kNoBody) continue;
            paths[i].cut(share[i] < kLeastShare || round >= kSoftRounds ? 0 : share[i]);
            changed[i] = true;
        }
        hits = find(frame, narrow, encounters, paths, changed, maxTests, workers, false);
    }
}

}  // namespace tessera::rigid
