#include "server/collision/rigid_bodies/NarrowPhase.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "common/base/Workers.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/rigid_bodies/FaceContacts.h"
#include "server/collision/rigid_bodies/SurfaceContacts.h"

namespace tessera::rigid {

namespace {

constexpr std::size_t kPerTask = 64;
/// Between two looks at how much work is left: what is done in vain beyond the limit stays bounded.
constexpr std::size_t kPerRound = 4096;
constexpr double kFine = 0.25;    ///< of the slop
constexpr double kNear = 0.01;    ///< of the smaller body's size
constexpr double kDeepest = 0.1;  ///< of the smaller body's size: of a depth that is an estimate

template <typename Task>
void runTasks(Workers* workers, std::size_t count, const Task& task) {
    if (workers == nullptr || count < 2) {
        for (std::size_t i = 0; i < count; ++i) task(i);
    } else {
        workers->run(count, std::cref(task));
    }
}

}  // namespace

void NarrowPhase::begin(const FrameBodies& frame, const NarrowOptions& options) {
    frame_ = &frame;
    options_ = options;
    usedBatches_ = usedRooms_ = 0;
    solids_.assign(frame.parts.size(), {});
}

void NarrowPhase::follow(const FrameBodies::Ranks& ranks) {
    std::vector<PlacedSolid> before = std::exchange(solids_, std::vector<PlacedSolid>(ranks.parts));
    for (std::size_t i = 0; i < before.size(); ++i) solids_[ranks.part[i]] = before[i];
}

void NarrowPhase::placeSolids(std::span<const FrameEncounter> encounters) {
    struct Job {
        std::uint32_t part;
        std::array<std::size_t, 3> at;
    };
    std::vector<Job> jobs;
    std::array<std::size_t, 3> used{};
    const auto want = [&](std::uint32_t p) {
        const FramePart& part = frame_->parts[p];
        if (!part.surface->solid || solids_[p].shape != nullptr) return;
        const SolidShape& shape = *part.surface->solid;
        solids_[p].shape = &shape;
        jobs.push_back({p, used});
        used[0] += shape.corners.size();
        used[1] += shape.sides();
        used[2] += placedEdges(shape);
    };
    for (const FrameEncounter& e : encounters) {
        want(e.partA);
        want(e.partB);
    }
    if (jobs.empty()) return;
    if (rooms_.size() == usedRooms_) rooms_.emplace_back();
    Room& room = rooms_[usedRooms_++];
    if (room.corners.size() < used[0]) room.corners.resize(used[0]);
    if (room.sides.size() < used[1]) room.sides.resize(used[1]);
    if (room.edges.size() < used[2]) room.edges.resize(used[2]);
    const auto task = [&](std::size_t t) {
        for (std::size_t i = t * kPerTask; i < std::min(jobs.size(), (t + 1) * kPerTask); ++i) {
            const Job& job = jobs[i];
            const SolidShape& shape = *solids_[job.part].shape;
            solids_[job.part] = place(shape, frame_->parts[job.part].given->world,
                                      std::span(room.corners).subspan(job.at[0], shape.corners.size()),
                                      std::span(room.sides).subspan(job.at[1], shape.sides()),
                                      std::span(room.edges).subspan(job.at[2], placedEdges(shape)));
        }
    };
    runTasks(options_.workers, (jobs.size() + kPerTask - 1) / kPerTask, task);
}

void NarrowPhase::find(std::span<FrameEncounter> encounters, QueryWork& work) {
    placeSolids(encounters);
    for (std::size_t round = 0; round < encounters.size(); round += kPerRound) {
        const std::span<FrameEncounter> some =
            encounters.subspan(round, std::min(kPerRound, encounters.size() - round));
        if (work.exhausted()) {
            for (FrameEncounter& e : some) e.known = false;
            continue;
        }
        const std::size_t tasks = (some.size() + kPerTask - 1) / kPerTask, first = usedBatches_;
        usedBatches_ += tasks;
        if (batches_.size() < usedBatches_) batches_.resize(usedBatches_);
        const std::uint64_t left = work.limit - (work.boxTests + work.triangleTests);
        runTasks(options_.workers, tasks, [&](std::size_t t) {
            EncounterBatch& batch = batches_[first + t];
            batch.points.clear();
            batch.within.clear();
            batch.each.clear();
            for (std::size_t i = t * kPerTask; i < std::min(some.size(), (t + 1) * kPerTask); ++i) {
                QueryWork own;
                own.limit = std::min(left, options_.maxTestsPerEncounter);
                some[i].batch = static_cast<std::uint32_t>(first + t);
                look(some[i], batch, own);
                batch.each.push_back(own);
            }
        });
        // In the order of the encounters: who comes too late does not depend on threads.
        for (std::size_t i = 0; i < some.size(); ++i) {
            const QueryWork& own = batches_[first + i / kPerTask].each[i % kPerTask];
            if (work.exhausted()) {
                some[i].known = false;
                some[i].points = 0;
            }
            work.boxTests += own.boxTests;
            work.triangleTests += own.triangleTests;
        }
    }
}

/// How much farther than its centre a point of a part may come in some direction, by its body's turning.
double NarrowPhase::turn(std::uint32_t part) const {
    const FramePart& of = frame_->parts[part];
    const FrameBody& body = frame_->bodies[of.body];
    if (body.asleep || body.frozen) return 0;
    const double angle = std::min(body.spin.norm() * options_.seconds, 2.0), unforeseen = body.free ? kUnforeseen : 0;
    if (!of.surface->solid) return (angle + unforeseen) * body.size;
    // What turns stays within a ball around its centre; what is nearly one comes no farther. The centre itself leaves
    // its straight way by as much as an arc leaves its tangent.
    const PlacedSolid& solid = solids_[part];
    return std::min(angle * solid.radius, solid.radius - solid.inner) + unforeseen * body.size +
           0.5 * angle * angle * (solid.centre - body.mass.centre).norm();
}

/// Of B, seen from A, within the frame: as their centres go, if nobody else meddles.
Vec3d NarrowPhase::approach(std::uint32_t partA, std::uint32_t partB) const {
    const auto at = [&](std::uint32_t p) {
        const FramePart& part = frame_->parts[p];
        const FrameBody& body = frame_->bodies[part.body];
        const Vec3d centre = part.surface->solid ? solids_[p].centre : Vec3d(part.box.center());
        if (body.asleep || body.frozen) return Vec3d(Vec3d::Zero());
        Vec3d v = body.velocity + body.spin.cross(centre - body.mass.centre);
        if (body.free) v += options_.seconds * options_.gravity;
        return Vec3d(v * options_.seconds);
    };
    return at(partB) - at(partA);
}

void NarrowPhase::look(FrameEncounter& e, EncounterBatch& batch, QueryWork& work) const {
    const FramePart &a = frame_->parts[e.partA], &b = frame_->parts[e.partB];
    const FrameBody &bodyA = frame_->bodies[a.body], &bodyB = frame_->bodies[b.body];
    e.firstPoint = static_cast<std::uint32_t>(batch.points.size());
    e.firstFace = static_cast<std::uint32_t>(batch.within.size());
    e.faces = 0;
    const double size = std::min(bodyA.size, bodyB.size), fine = kFine * slopOf(bodyA, bodyB);
    // No farther than both may go; and as far as they go towards each other, if nobody else meddles.
    const auto own = [](const FrameBody& body) { return body.free || body.moving ? body.reach : 0; };
    const double fall = 2 * options_.gravity.norm() * options_.seconds * options_.seconds;
    const double slack = fall + turn(e.partA) + turn(e.partB);
    const double margin = std::min(own(bodyA) + own(bodyB), approach(e.partA, e.partB).norm() + slack);
    if (a.surface->solid && b.surface->solid) {
        // Most neighbours of what falls side by side: their boxes, grown on all sides, meet, and no more.
        const PlacedSolid &placedA = solids_[e.partA], &placedB = solids_[e.partB];
        const double apart = margin + placedA.radius + placedB.radius;
        if ((placedB.centre - placedA.centre).squaredNorm() > apart * apart) {
            ++work.boxTests;
            e.known = true;
            e.parted = {margin, Vec3d::Zero()};
            return;
        }
        const SolidPart solidA{&solids_[e.partA], a.given->hull, &a.given->world},
            solidB{&solids_[e.partB], b.given->hull, &b.given->world};
        e.known = contactsOfSolids(solidA, solidB, {margin, fine, kNear * size, approach(e.partA, e.partB)}, e.memory,
                                   batch.scratch, work, batch.points, e.parted);
    } else if (a.surface->solid) {
        e.known = solidWithFaces(e.partA, e.partB, e, margin, slack, fine, batch, work);
    } else if (b.surface->solid) {
        e.known = solidWithFaces(e.partB, e.partA, e, margin, slack, fine, batch, work);
    } else {
        const SurfacePart surfaceA{a.given->tree, a.surface->topology.get(), a.given->world, bodyA.mass.centre};
        const SurfacePart surfaceB{b.given->tree, b.surface->topology.get(), b.given->world, bodyB.mass.centre};
        e.slack = e.nearest = margin;
        e.known = contactsOfSurfaces(surfaceA, surfaceB, {margin, kNear * size, kDeepest * size, bodyB.free}, work,
                                     batch.points);
    }
    if (!e.known) batch.points.resize(e.firstPoint);
    e.points = static_cast<std::uint32_t>(batch.points.size()) - e.firstPoint;
}

bool NarrowPhase::solidWithFaces(std::uint32_t solidPart, std::uint32_t facePart, FrameEncounter& e, double margin,
                                 double slack, double fine, EncounterBatch& batch, QueryWork& work) const {
    const FramePart &with = frame_->parts[solidPart], &of = frame_->parts[facePart];
    const PlacedSolid& solid = solids_[solidPart];
    FaceQuery query;
    query.margin = margin;
    query.slack = slack;
    e.slack = e.nearest = std::min(margin, slack);
    query.fine = fine;
    query.near = kNear * std::min(frame_->bodies[with.body].size, frame_->bodies[of.body].size);
    query.approach = approach(facePart, solidPart);
    query.solidIsA = solidPart == e.partA;
    // Where it is on its way; not all that could be reached in some direction.
    Box box = solid.box;
    box.extend(Box{box.lower + query.approach, box.upper + query.approach});
    box.lower.array() -= slack;
    box.upper.array() += slack;
    const Affine3d back = of.given->world.inverse();
    batch.faces.clear();
    if (!back.matrix().allFinite() || !facesNear(*of.given->tree, box.transformed(back), work, batch.faces))
        return false;
    const PlacedSurface surface{&of.given->tree->mesh(), of.surface->topology.get(), of.given->world};
    contactsWithFaces(solid, surface, batch.faces, query, batch.scratch, batch.within, batch.points);
    e.faces = static_cast<std::uint32_t>(batch.within.size()) - e.firstFace;
    for (std::size_t i = e.firstFace; i < batch.within.size(); ++i)
        e.nearest = std::min(e.nearest, batch.within[i].gap);
    return true;
}

}  // namespace tessera::rigid
