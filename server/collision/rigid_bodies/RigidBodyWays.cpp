/// Nothing gets through anything on its way: what is done with what the guard finds.
#include <utility>

#include "server/collision/rigid_bodies/RigidBodyState.h"

namespace tessera {

using namespace rigid;

namespace {

/// How often islands are solved again with the points that sweeps have found, before ways are cut.
constexpr int kGuardRounds = 3;

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

/// Points that a sweep has found, among those of their encounters.
void RigidBodyStage::State::addPoints(std::span<const PathGuard::Hit> hits) {
    std::vector<SolverPoint> all, allUnsolved;
    std::vector<std::uint32_t> ofEncounter;
    std::size_t p = 0;
    const auto upTo = [&](std::uint32_t encounter) {
        for (; p < points.size() && pointEncounter[p] <= encounter; ++p) {
            all.push_back(points[p]);
            allUnsolved.push_back(unsolvedPoints[p]);
            ofEncounter.push_back(pointEncounter[p]);
        }
    };
    for (const PathGuard::Hit& hit : hits) {
        upTo(hit.encounter);
        const FrameEncounter& e = looked[hit.encounter];
        const FrameBody &a = bodyOf(e.partA), &b = bodyOf(e.partB);
        const double slop = narrow.slopOf(a, b);
        SolverPoint point = pointFor(e);
        for (const SweepPoint& from : hit.found.points) {
            setNormal(point, from.normal);
            point.armA = from.onA - a.mass.centre;
            point.armB = from.onB - b.mass.centre;
            point.gap = from.gap + slop;
            all.push_back(point);
            allUnsolved.push_back(point);
            ofEncounter.push_back(hit.encounter);
        }
    }
    upTo(kNobody);
    points = std::move(all);
    unsolvedPoints = std::move(allUnsolved);
    pointEncounter = std::move(ofEncounter);
}

/// Nothing gets through anything, also where the points that were foreseen did not hold it.
void RigidBodyStage::State::goSafely() {
    std::vector<bool> changed(solver.size(), true), moves(solver.size());
    for (std::size_t i = 0; i < solver.size(); ++i) {
        moves[i] = solver[i].inverseMass > 0;
        limitReach(i);
    }
    makePaths(changed);
    pathGuard.begin();
    for (int round = 0;; ++round) {
        std::vector<PathGuard::Hit> hits =
            pathGuard.find(frame, narrow, looked, paths, changed, options.maxTestsPerEncounter, workers);
        if (hits.empty()) return;
        if (round == kGuardRounds) {
            pathGuard.cut(frame, narrow, looked, std::move(hits), paths, moves, options.maxTestsPerEncounter, workers);
            for (std::size_t i = 0; i < solver.size(); ++i)
                if (moves[i]) {
                    solver[i].moved = paths[i].moved;
                    solver[i].turned = paths[i].turned;
                }
            return;
        }
        std::vector<bool> touched(solver.size(), false);
        for (const PathGuard::Hit& hit : hits) {
            const FrameEncounter& e = looked[hit.encounter];
            for (const std::uint32_t part : {e.partA, e.partB})
                if (moves[frame.parts[part].body]) touched[frame.parts[part].body] = true;
        }
        addPoints(hits);
        changed = solve(&touched);
        for (std::size_t i = 0; i < solver.size(); ++i)
            if (changed[i]) limitReach(i);
        makePaths(changed);
    }
}

}  // namespace tessera
