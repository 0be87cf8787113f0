#include "server/collision/dynamics/NarrowPhase.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/base/Workers.h"
#include "server/collision/dynamics/FaceContacts.h"
#include "server/collision/dynamics/MeshFaces.h"
#include "server/collision/dynamics/SurfaceContacts.h"

namespace tessera::dynamics {

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
    usedBatches_ = 0;
    solids_.assign(frame.parts.size(), {});
    used_ = {};
    std::array<std::size_t, 3> room{};
    for (const FramePart& part : frame.parts) {
        if (part.surface == nullptr || !part.surface->solid) continue;
        const SolidShape& shape = *part.surface->solid;
        room[0] += shape.corners.size();
        room[1] += shape.sides();
        room[2] += placedEdges(shape);
    }
    // Views into them are handed out: they must not move within the frame.
    if (corners_.size() < room[0]) corners_.resize(room[0]);
    if (sides_.size() < room[1]) sides_.resize(room[1]);
    if (edges_.size() < room[2]) edges_.resize(room[2]);
}

void NarrowPhase::placeSolids(std::span<const FrameEncounter> encounters) {
    struct Job {
        std::uint32_t part;
        std::array<std::size_t, 3> at;
    };
    std::vector<Job> jobs;
    const auto want = [&](std::uint32_t p) {
        const FramePart& part = frame_->parts[p];
        if (!part.surface->solid || solids_[p].shape != nullptr) return;
        const SolidShape& shape = *part.surface->solid;
        solids_[p].shape = &shape;
        jobs.push_back({p, used_});
        used_[0] += shape.corners.size();
        used_[1] += shape.sides();
        used_[2] += placedEdges(shape);
    };
    for (const FrameEncounter& e : encounters) {
        want(e.partA);
        want(e.partB);
    }
    const auto task = [&](std::size_t t) {
        for (std::size_t i = t * kPerTask; i < std::min(jobs.size(), (t + 1) * kPerTask); ++i) {
            const Job& job = jobs[i];
            const SolidShape& shape = *solids_[job.part].shape;
            solids_[job.part] = place(shape, frame_->parts[job.part].given->world,
                                      std::span(corners_).subspan(job.at[0], shape.corners.size()),
                                      std::span(sides_).subspan(job.at[1], shape.sides()),
                                      std::span(edges_).subspan(job.at[2], placedEdges(shape)));
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
            batch.faces.clear();
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

Vec3d NarrowPhase::approach(const FramePart& a, const FramePart& b) const {
    const auto at = [&](const FramePart& part) {
        const FrameBody& body = frame_->bodies[part.body];
        if (body.asleep || body.frozen) return Vec3d(Vec3d::Zero());
        Vec3d v = body.velocity + body.spin.cross(part.box.center() - body.mass.centre);
        if (body.free) v += options_.seconds * options_.gravity;
        return Vec3d(v * options_.seconds);
    };
    return at(b) - at(a);
}

void NarrowPhase::look(FrameEncounter& e, EncounterBatch& batch, QueryWork& work) const {
    const FramePart &a = frame_->parts[e.partA], &b = frame_->parts[e.partB];
    const FrameBody &bodyA = frame_->bodies[a.body], &bodyB = frame_->bodies[b.body];
    e.firstPoint = static_cast<std::uint32_t>(batch.points.size());
    e.firstFace = static_cast<std::uint32_t>(batch.faces.size());
    const double size = std::min(bodyA.size, bodyB.size), fine = kFine * slopOf(bodyA, bodyB);
    // No farther than both may go; and as far as they go towards each other, if nobody else meddles.
    const auto own = [](const FrameBody& body) { return body.free || body.moving ? body.reach : 0; };
    const auto turn = [&](const FrameBody& body) {
        return (std::min(body.spin.norm() * options_.seconds, 2.0) + (body.free ? kUnforeseen : 0)) * body.size;
    };
    const double fall = 2 * options_.gravity.norm() * options_.seconds * options_.seconds;
    const double slack = fall + turn(bodyA) + turn(bodyB);
    const double margin = std::min(own(bodyA) + own(bodyB), approach(a, b).norm() + slack);
    if (a.surface->solid && b.surface->solid) {
        const SolidPart solidA{&solids_[e.partA], a.given->hull, &a.given->world},
            solidB{&solids_[e.partB], b.given->hull, &b.given->world};
        e.known = contactsOfSolids(solidA, solidB, {margin, fine, kNear * size, approach(a, b)}, e.memory,
                                   batch.scratch, work, batch.points);
    } else if (a.surface->solid) {
        e.known = solidWithFaces(e.partA, e.partB, e, margin, slack, fine, batch, work);
    } else if (b.surface->solid) {
        e.known = solidWithFaces(e.partB, e.partA, e, margin, slack, fine, batch, work);
    } else {
        const SurfacePart surfaceA{a.given->tree, a.surface->topology.get(), a.given->world, bodyA.mass.centre};
        const SurfacePart surfaceB{b.given->tree, b.surface->topology.get(), b.given->world, bodyB.mass.centre};
        e.known = contactsOfSurfaces(surfaceA, surfaceB, {margin, kNear * size, kDeepest * size, bodyB.free}, work,
                                     batch.points);
    }
    if (!e.known) batch.points.resize(e.firstPoint);
    e.points = static_cast<std::uint32_t>(batch.points.size()) - e.firstPoint;
    e.faces = static_cast<std::uint32_t>(batch.faces.size()) - e.firstFace;
}

bool NarrowPhase::solidWithFaces(std::uint32_t solidPart, std::uint32_t facePart, FrameEncounter& e, double margin,
                                 double slack, double fine, EncounterBatch& batch, QueryWork& work) const {
    const FramePart &with = frame_->parts[solidPart], &of = frame_->parts[facePart];
    Box box = solids_[solidPart].box;
    box.lower.array() -= margin;
    box.upper.array() += margin;
    const Affine3d back = of.given->world.inverse();
    if (!back.matrix().allFinite() || !facesNear(*of.given->tree, box.transformed(back), work, batch.faces))
        return false;
    FaceQuery query;
    query.margin = margin;
    query.slack = slack;
    query.fine = fine;
    query.near = kNear * std::min(frame_->bodies[with.body].size, frame_->bodies[of.body].size);
    query.approach = approach(of, with);
    query.solidIsA = solidPart == e.partA;
    e.leastPlane = std::numeric_limits<double>::infinity();
    const PlacedSurface surface{&of.given->tree->mesh(), of.surface->topology.get(), of.given->world};
    contactsWithFaces(solids_[solidPart], surface, std::span(batch.faces).subspan(e.firstFace), query, batch.scratch,
                      e.leastPlane, batch.points);
    return true;
}

}  // namespace tessera::dynamics
