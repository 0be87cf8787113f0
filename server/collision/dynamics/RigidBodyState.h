/// What a stage remembers, and the steps of a frame; for the files of this folder.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/dynamics/ContactMemory.h"
#include "server/collision/dynamics/ContactSolver.h"
#include "server/collision/dynamics/FrameBodies.h"
#include "server/collision/dynamics/NarrowPhase.h"
#include "server/collision/dynamics/PathGuard.h"
#include "server/collision/dynamics/RigidBodyStage.h"
#include "server/collision/dynamics/Sleepers.h"

namespace tessera::dynamics {

/// Sizes per second at which overlap is undone, at most.
inline constexpr double kPushSizes = 3;

}  // namespace tessera::dynamics

namespace tessera {

struct RigidBodyStage::State {
    RigidOptions options;
    Workers* workers = nullptr;

    std::uint64_t frameNumber = 0;
    dynamics::ShapeMemory shapes;
    dynamics::Sleepers sleepers;
    dynamics::ContactMemory memory, next;
    struct Calm {
        std::uint64_t body = 0;
        double seconds = 0;
        Vec3d moved = Vec3d::Zero();  ///< since it began to be calm
        Quatd turned = Quatd::Identity();
    };
    std::vector<Calm> calm;  ///< ascending; of free bodies that are awake
    double lastSeconds = 0;

    // Of the frame; kept for their memory.
    dynamics::FrameBodies frame;
    dynamics::NarrowPhase narrow;
    std::vector<dynamics::FrameEncounter> open, idle, looked;
    std::vector<dynamics::PointMemory> woken;
    std::vector<dynamics::PairMemory> wokenPairs;
    std::vector<dynamics::SolverBody> solver, unsolved;
    std::vector<dynamics::SolverPoint> points, unsolvedPoints, sorted;
    dynamics::PathGuard pathGuard;
    std::vector<dynamics::BodyPath> paths;
    std::vector<std::uint32_t> pointEncounter, order;
    Vec3d gravity = Vec3d::Zero();
    double seconds = 0;
    RigidSource* source = nullptr;
    std::vector<std::uint64_t> fetched;  // bodies

    void collect(std::span<const RigidEncounter> encounters);
    void wake(std::vector<dynamics::SleepingGroup> groups);
    void fetch(std::span<const dynamics::SleepingGroup> groups);
    void look(QueryWork& work, RigidFrame& out);
    void recallHints(std::vector<dynamics::FrameEncounter>& encounters);
    bool presses(const dynamics::FrameEncounter& e, const dynamics::FrameBody& awake) const;
    void makePoints();
    [[nodiscard]] dynamics::SolverPoint pointFor(const dynamics::FrameEncounter& e) const;
    /// Only the islands of bodies that are `touched`, from where the frame begins; null: all.
    /// Says whose ways are others now.
    std::vector<bool> solve(const std::vector<bool>* touched);
    void limitReach(std::size_t rank);
    void goSafely();
    void makePaths(const std::vector<bool>& of);
    void addPoints(std::span<const dynamics::PathGuard::Hit> hits);
    void finish(RigidFrame& out);
    void calmDown();
    void remember();
    void sleep(RigidFrame& out);
    [[nodiscard]] bool active(const dynamics::FrameEncounter& e) const;
    [[nodiscard]] dynamics::FrameBody& bodyOf(std::uint32_t part) { return frame.bodies[frame.parts[part].body]; }
    [[nodiscard]] const dynamics::FrameBody& bodyOf(std::uint32_t part) const {
        return frame.bodies[frame.parts[part].body];
    }
    [[nodiscard]] std::span<const dynamics::PointMemory> remembered(const dynamics::FrameEncounter& e) const;
};

}  // namespace tessera
