/// Nothing gets through anything on its way: what is done with what the guard finds.
#include <algorithm>
#include <iterator>
#include <utility>

#include "server/collision/rigid_bodies/RigidBodyState.h"

namespace tessera {

using namespace rigid;

namespace {

/// How often islands are solved again with the points that sweeps have found, before ways are cut.
constexpr int kGuardRounds = 3;
/// Bodies: larger islands once. What does not settle then is squeezed between things that do not give way, mostly, and
/// would not settle in three rounds either.
constexpr std::uint32_t kLargeIsland = 200;

}  // namespace

/// Where the solver has sent them (body.moved, body.turned); of what does not give way, where it goes.
void RigidBodyStage::State::makePaths(const std::vector<bool>& of) {
    paths.resize(solver.size());
    for (std::size_t i = 0; i < solver.size(); ++i) {
        if (!of[i]) continue;
        const SolverBody& body = solver[i];
        const FrameBody& from = frame.bodies[i];
        if (body.inverseMass > 0)
            paths[i] = BodyPath(from.mass.centre, body.moved, body.turned);
        else
            paths[i] = BodyPath(from.mass.centre, seconds * body.velocity, turnBy(body.spin, seconds));
    }
}

/// Points that a sweep has found, behind those of their encounters.
void RigidBodyStage::State::addPoints(std::span<const PathGuard::Hit> hits) {
    std::size_t from = points.size(), to = from;
    for (const PathGuard::Hit& hit : hits) to += hit.found.points.size();
    points.resize(to);
    pointStarts.resize(to, PointStart{0, 0, 0});
    pointEncounter.resize(to);
    // From behind, so that each is moved once at most.
    for (std::size_t h = hits.size(); h-- > 0 && to > from;) {
        const PathGuard::Hit& hit = hits[h];
        for (; from > 0 && pointEncounter[from - 1] > hit.encounter; --from) {
            --to;
            points[to] = points[from - 1];
            pointStarts[to] = pointStarts[from - 1];
            pointEncounter[to] = pointEncounter[from - 1];
        }
        const FrameEncounter& e = looked[hit.encounter];
        const FrameBody &a = bodyOf(e.partA), &b = bodyOf(e.partB);
        SolverPoint point = pointFor(e);
        to -= hit.found.points.size();
        for (std::size_t i = 0; i < hit.found.points.size(); ++i) {
            const SweepPoint& found = hit.found.points[i];
            setNormal(point, found.normal);
            point.armA = found.onA - a.mass.centre;
            point.armB = found.onB - b.mass.centre;
            point.gap = found.gap + narrow.slopOf(a, b);
            points[to + i] = point;
            pointStarts[to + i] = PointStart{0, 0, 0};
            pointEncounter[to + i] = hit.encounter;
        }
    }
}

/// Wakes sleepers that something runs into which does not give way. (Something that does is held by a sleeper, and
/// wakes it in the next frame, when it presses on it.) False: there are none.
bool RigidBodyStage::State::wakeWhoIsHit(std::span<const PathGuard::Hit> hits) {
    std::vector<std::uint64_t> toWake;
    for (const PathGuard::Hit& hit : hits) {
        const FrameEncounter& e = looked[hit.encounter];
        const FrameBody &a = bodyOf(e.partA), &b = bodyOf(e.partB);
        if (a.asleep && !b.free) toWake.push_back(a.given->id);
        if (b.asleep && !a.free) toWake.push_back(b.given->id);
    }
    return wake(toWake);
}

/// Nothing gets through anything, also where the points that were foreseen did not hold it.
bool RigidBodyStage::State::goSafely() {
    const std::size_t count = solver.size();
    std::vector<bool> changed(count, true), moves(count), settled(count, false);
    for (std::size_t i = 0; i < count; ++i) {
        moves[i] = solver[i].inverseMass > 0;
        limitReach(i);
    }
    makePaths(changed);
    pathGuard.begin();
    std::vector<PathGuard::Hit> left;
    const auto anyOf = [&](const std::vector<bool>& bodies, const PathGuard::Hit& hit) {
        const FrameEncounter& e = looked[hit.encounter];
        return bodies[frame.parts[e.partA].body] || bodies[frame.parts[e.partB].body];
    };
    for (int round = 0;; ++round) {
        std::vector<PathGuard::Hit> hits =
            pathGuard.find(frame, narrow, looked, paths, changed, options.maxTestsPerEncounter, workers);
        if (round == 0 && wakeWhoIsHit(hits)) return false;
        // Where neither gives way in this frame there is no island to solve, and no way to cut.
        std::erase_if(hits, [&](const PathGuard::Hit& hit) { return !anyOf(moves, hit); });
        std::erase_if(left, [&](const PathGuard::Hit& hit) { return anyOf(changed, hit); });
        const auto rest = std::stable_partition(hits.begin(), hits.end(), [&](const PathGuard::Hit& hit) {
            return round < kGuardRounds && !anyOf(settled, hit);
        });
        std::move(rest, hits.end(), std::back_inserter(left));
        hits.erase(rest, hits.end());
        if (hits.empty()) break;
        std::vector<bool> touched(count, false);
        for (const PathGuard::Hit& hit : hits) {
            const FrameEncounter& e = looked[hit.encounter];
            for (const std::uint32_t part : {e.partA, e.partB})
                if (moves[frame.parts[part].body]) touched[frame.parts[part].body] = true;
        }
        addPoints(hits);
        changed = solve(&touched);
        for (std::size_t i = 0; i < count; ++i) {
            if (!changed[i]) continue;
            limitReach(i);
            if (islandSize[i] > kLargeIsland) settled[i] = true;
        }
        makePaths(changed);
    }
    if (left.empty()) return true;
    std::ranges::sort(left, {}, &PathGuard::Hit::encounter);
    pathGuard.cut(frame, narrow, looked, std::move(left), paths, moves, options.maxTestsPerEncounter, workers);
    for (std::size_t i = 0; i < count; ++i)
        if (moves[i]) {
            solver[i].moved = paths[i].moved;
            solver[i].turned = paths[i].turned;
        }
    return true;
}

}  // namespace tessera
