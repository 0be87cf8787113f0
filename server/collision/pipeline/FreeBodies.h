/// Free bodies of the scene, handed to the rigid-body stage and back.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/collision/dynamics/RigidBodyStage.h"
#include "server/collision/pipeline/PairMemory.h"
#include "server/collision/pipeline/StepResult.h"
#include "server/collision/response/Way.h"

namespace tessera {

/// Not thread-safe.
class FreeBodies {
public:
    explicit FreeBodies(Workers* workers) : stage_({}, workers) {}

    /// Once a frame, before anything moves: who is free, and who has been disturbed since the last frame (put elsewhere, given
    /// another velocity, mass or shape; all, when interests have changed). `held`: transforms that somebody else moves in
    /// this frame; the bodies that they carry are not free in it.
    void begin(const ObjectHandler& handler, std::span<const ObjectId> held);

    [[nodiscard]] bool any() const { return !free_.empty(); }
    /// Bodies free in this frame, ascending.
    [[nodiscard]] std::span<const std::uint32_t> free() const { return free_; }
    [[nodiscard]] bool isFree(std::uint32_t body) const { return roles_[body] != Role::kOther; }
    [[nodiscard]] bool asleep(std::uint32_t body) const { return roles_[body] == Role::kAsleep; }
    /// Where a free body's part may be at the end of the frame at the furthest.
    [[nodiscard]] Box reach(const ObjectHandler& handler, std::uint32_t part, double seconds) const;

    struct Moved {
        std::uint32_t body = 0;
        Way way;  ///< of its transform's local value
    };
    struct Outcome {
        std::vector<Moved> moved;  ///< ascending by transform
        std::vector<BodyVelocity> velocities;
        std::vector<NotLookedAt> notLookedAt;
        std::size_t asleep = 0;
    };
    /// Lets a frame pass. Everything else that moves in it is where it will be at its end; `startWorlds`: the world poses of
    /// those parts as the frame begins.
    using StartWorlds = std::unordered_map<std::uint32_t, Affine3d>;
    [[nodiscard]] Outcome advance(const Aspect& committed, const ObjectHandler& handler, std::span<const PairState> pairs,
                                  const StartWorlds& startWorlds, double seconds, QueryWork& work);
    /// After the step: poses as they are left behind.
    void end(const ObjectHandler& handler, std::span<const BodyVelocity> velocities);

private:
    enum class Role : std::uint8_t { kOther, kAwake, kAsleep };
    /// As the last frame left it.
    struct Left {
        std::uint64_t poseVersion = 0;  // the sum over its parts: changes when one does
        Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
        double mass = 0, restitution = 0, friction = 0;
    };
    [[nodiscard]] static std::uint64_t versionOf(const ObjectHandler& handler, const Body& body);
    void gather(const ObjectHandler& handler, std::span<const PairState> pairs, const StartWorlds& startWorlds, double seconds);
    std::uint32_t rigidPart(const ObjectHandler& handler, std::uint32_t part, const StartWorlds& startWorlds, double seconds);

    RigidBodyStage stage_;
    std::vector<Role> roles_;            // per body of the handler
    std::vector<bool> disturbed_;        // per body
    std::vector<std::uint32_t> free_;
    std::unordered_map<ObjectId, Left> left_;  // by CollisionObject core
    std::vector<std::pair<ObjectId, std::int64_t>> responses_;  // of the interests of the last frame
    std::unordered_map<std::uint64_t, std::uint32_t> partOfNode_;
    std::uint64_t generation_ = 0;
    // Kept for their memory.
    std::vector<RigidBody> bodies_;
    std::vector<RigidPart> parts_;
    std::vector<RigidEncounter> encounters_;
    std::vector<std::uint32_t> rigidPartOf_;  // per part of the handler; kNobody
};

}  // namespace tessera
