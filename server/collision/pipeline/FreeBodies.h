/// Free bodies of the scene, handed to the rigid-body stage and back.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/collision/dynamics/RigidBodyStage.h"
#include "server/collision/pipeline/Admission.h"
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

    /// Who is of interest to whom may be another matter now: in the next frame everybody is disturbed.
    void rulesChanged() { rulesChanged_ = true; }

    [[nodiscard]] bool any() const { return !free_.empty(); }
    /// All of them sleep, and nothing about them or about who is free has changed since the last frame.
    [[nodiscard]] bool resting() const { return unchanged_; }
    /// Bodies that are free in this frame and were not in the last one, or the other way about.
    [[nodiscard]] std::span<const std::uint32_t> changed() const { return changed_; }
    /// Parts that have moved, and whether any has come or gone, since the last frame.
    void noteMoved(const ObjectHandler& handler, std::span<const std::uint32_t> parts, bool others);
    /// Bodies free in this frame, ascending.
    [[nodiscard]] std::span<const std::uint32_t> free() const { return free_; }
    [[nodiscard]] bool isFree(std::uint32_t body) const { return body < roles_.size() && roles_[body] != Role::kOther; }
    [[nodiscard]] bool asleep(std::uint32_t body) const { return body < roles_.size() && roles_[body] == Role::kAsleep; }
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
    [[nodiscard]] Outcome advance(const Aspect& committed, const ObjectHandler& handler, PairMemory& memory,
                                  const StartWorlds& startWorlds, double seconds, QueryWork& work);
    /// What becomes of free bodies that these have moved: what a motion moves keeps its pace when it is let go, what a hand puts
    /// somewhere is at rest there. Velocities that change, ascending by core.
    [[nodiscard]] static std::vector<BodyVelocity> letGo(const ObjectHandler& handler,
                                                         std::initializer_list<std::span<const Mover>> movers, double seconds);
    /// After the step: poses as they are left behind.
    void end(const ObjectHandler& handler, std::span<const BodyVelocity> velocities);

private:
    enum class Role : std::uint8_t { kOther, kAwake, kAsleep };
    /// As the last frame left it.
    struct Left {
        ObjectId core;
        std::uint32_t body = 0;
        std::uint64_t poseVersion = 0;  // the sum over its parts: changes when one does
        Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
        double mass = 0, restitution = 0, friction = 0;
    };
    [[nodiscard]] static std::uint64_t versionOf(const ObjectHandler& handler, const Body& body);
    [[nodiscard]] const Left* leftOf(std::uint32_t body, ObjectId core) const;
    [[nodiscard]] bool mayMeet(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds) const;
    [[nodiscard]] bool supports(const ObjectHandler& handler, std::uint32_t part) const;
    [[nodiscard]] bool sameSupports(const ObjectHandler& handler, const StartWorlds& startWorlds);
    void noteSupports(const ObjectHandler& handler, const StartWorlds& startWorlds);
    void gather(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds, double seconds);
    std::uint32_t rigidPart(const ObjectHandler& handler, std::uint32_t part, const StartWorlds& startWorlds, double seconds);

    RigidBodyStage stage_;
    std::vector<Role> roles_;            // per body of the handler
    std::vector<bool> disturbed_;        // per body
    std::vector<std::uint32_t> free_, changed_;
    std::vector<Left> left_;             // ascending by body
    mutable IdTable leftOfCore_;         // where a body has another number now; made when asked for
    mutable bool leftIndexed_ = false;
    std::uint64_t version_ = 0;          // of the handler's free bodies, when the last frame ended
    bool anyHeld_ = false;
    bool allAsleep_ = false, unchanged_ = false;
    bool told_ = false;                  // the stage knows of the last change
    /// Parts that sleepers lean on, and their poses, when the stage last ran; version 0: on the move.
    std::vector<std::pair<std::uint64_t, std::uint64_t>> supports_;
    bool supportsStand_ = false;         // as they did then, as far as is known
    Vec3d gravity_ = Vec3d::Zero();      // then
    bool rulesChanged_ = false;
    std::vector<std::pair<ObjectId, std::int64_t>> responses_;  // of the interests of the last frame
    std::uint64_t interestsVersion_ = 0, generation_ = 0;
    // Kept for their memory.
    std::vector<RigidBody> bodies_;
    std::vector<RigidPart> parts_;
    std::vector<RigidEncounter> encounters_;
    std::vector<std::uint32_t> rigidPartOf_;  // per part of the handler; kNobody
    std::vector<std::uint32_t> given_;        // parts that have one
};

}  // namespace tessera
