/// What a stage remembers, and the steps of a frame; for the files of this folder.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/rigid_bodies/ContactMemory.h"
#include "server/collision/rigid_bodies/ContactSolver.h"
#include "server/collision/rigid_bodies/FrameBodies.h"
#include "server/collision/rigid_bodies/NarrowPhase.h"
#include "server/collision/rigid_bodies/PathGuard.h"
#include "server/collision/rigid_bodies/RigidBodyStage.h"
#include "server/collision/rigid_bodies/Sleepers.h"

namespace tessera::rigid {

/// Sizes per second at which overlap is undone, at most.
inline constexpr double kPushSizes = 3;

}  // namespace tessera::rigid

namespace tessera {

struct RigidBodyStage::State {
    RigidOptions options;
    Workers* workers = nullptr;

    std::uint64_t frameNumber = 0;
    rigid::ShapeMemory shapes;
    rigid::Sleepers sleepers;
    rigid::ContactMemory memory, next;
    struct Calm {
        std::uint64_t body = 0;
        double seconds = 0;
        Vec3d moved = Vec3d::Zero();  ///< since it began to be calm
        Quatd turned = Quatd::Identity();
    };
    std::vector<Calm> calm;  ///< ascending; of free bodies that are awake
    double lastSeconds = 0;

    // Of the frame; kept for their memory.
    rigid::FrameBodies frame;
    rigid::NarrowPhase narrow;
    std::vector<rigid::FrameEncounter> open, idle, looked;
    std::vector<rigid::PointMemory> woken;
    std::vector<rigid::PairMemory> wokenPairs;
    std::vector<rigid::SolverBody> solver, unsolved;
    std::vector<rigid::SolverPoint> points, sorted;
    using PointStart = std::array<double, 3>;
    std::vector<PointStart> pointStarts;    ///< impulse and rubbing that the points start from
    std::vector<std::uint32_t> islandSize;  ///< per body, as it was solved last
    rigid::PathGuard pathGuard;
    std::vector<rigid::BodyPath> paths;
    std::vector<std::uint32_t> pointEncounter, order;
    Vec3d gravity = Vec3d::Zero();
    double seconds = 0;
    RigidSource* source = nullptr;
    std::vector<std::uint64_t> fetched;  // bodies

    void collect(std::span<const RigidEncounter> encounters);
    /// Tells whether the parts are of two bodies and one of them is free: no impulse moves others.
    [[nodiscard]] bool mayMeet(std::uint32_t partA, std::uint32_t partB) const;
    void wake(std::vector<rigid::SleepingGroup> groups);
    /// Wakes bodies, and those who sleep with them. False: all were awake.
    bool wake(std::span<const std::uint64_t> bodies);
    void fetch(std::span<const rigid::SleepingGroup> groups);
    void look(QueryWork& work, RigidFrame& out);
    void recallHints(std::vector<rigid::FrameEncounter>& encounters);
    bool presses(const rigid::FrameEncounter& e, const rigid::FrameBody& awake) const;
    void makePoints();
    [[nodiscard]] rigid::SolverPoint pointFor(const rigid::FrameEncounter& e) const;
    /// Only the islands of bodies that are `touched`, from where the frame begins; null: all.
    /// Says whose ways are others now.
    std::vector<bool> solve(const std::vector<bool>* touched);
    void limitReach(std::size_t rank);
    /// False: something has run into sleepers. They are awake now, and the frame is to be looked at and solved again.
    [[nodiscard]] bool goSafely();
    [[nodiscard]] bool wakeWhoIsHit(std::span<const rigid::PathGuard::Hit> hits);
    void makePaths(const std::vector<bool>& of);
    void addPoints(std::span<const rigid::PathGuard::Hit> hits);
    void finish(RigidFrame& out);
    void calmDown();
    void remember();
    void sleep(RigidFrame& out);
    [[nodiscard]] bool active(const rigid::FrameEncounter& e) const;
    [[nodiscard]] rigid::FrameBody& bodyOf(std::uint32_t part) { return frame.bodies[frame.parts[part].body]; }
    [[nodiscard]] const rigid::FrameBody& bodyOf(std::uint32_t part) const {
        return frame.bodies[frame.parts[part].body];
    }
    [[nodiscard]] std::span<const rigid::PointMemory> remembered(const rigid::FrameEncounter& e) const;
};

}  // namespace tessera
