/// Free bodies of the scene, handed to the rigid-body stage and back.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/collision/objects/IdTable.h"
#include "server/collision/pipeline/Admission.h"
#include "server/collision/pipeline/PairMemory.h"
#include "server/collision/pipeline/StepResult.h"
#include "server/collision/response/Way.h"
#include "server/collision/rigid_bodies/RigidBodyStage.h"

namespace tessera {

/// A frame costs what is awake, what has changed and what is near: sleepers about whom nothing is new are not looked
/// at. Not thread-safe.
class FreeBodies {
public:
    explicit FreeBodies(Workers* workers) : stage_({}, workers) {}

    /// Once a frame, before anything moves: who is free, and who has been disturbed since the last frame (put
    /// elsewhere, given another velocity, mass or shape; all, when interests have changed). `held`: bodies that
    /// somebody else moves in this frame; they are not free in it.
    void begin(ObjectHandler& handler, std::vector<std::uint32_t> held);

    /// Who is of interest to whom may be another matter now: in the next frame everybody is disturbed.
    void rulesChanged() { rulesChanged_ = true; }

    [[nodiscard]] bool any() const { return count() > 0; }
    [[nodiscard]] std::size_t count() const { return slotOfCore_.size(); }
    /// All of them sleep, and nothing about them or about who is free has changed since the last frame.
    [[nodiscard]] bool resting() const { return unchanged_; }
    /// Bodies that are free in this frame and were not in the last one, or the other way about.
    [[nodiscard]] std::span<const std::uint32_t> changed() const { return changed_; }
    /// Parts that have moved, or have come or gone, since the last frame.
    void noteMoved(std::span<const std::uint32_t> parts);
    /// Bodies free in this frame that do not sleep, ascending.
    [[nodiscard]] std::span<const std::uint32_t> awake() const { return awake_; }
    [[nodiscard]] bool isFree(std::uint32_t body) const {
        return body < slotOfBody_.size() && slotOfBody_[body] != kNobody;
    }
    [[nodiscard]] bool asleep(std::uint32_t body) const { return isFree(body) && known_[slotOfBody_[body]].asleep; }
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
        std::size_t handedOver = 0;  ///< bodies that the rigid-body stage was given
    };
    /// Lets a frame pass. Everything else that moves in it is where it will be at its end; `startWorlds`: the world
    /// poses of those parts as the frame begins.
    using StartWorlds = std::unordered_map<std::uint32_t, Affine3d>;
    [[nodiscard]] Outcome advance(const Aspect& committed, const ObjectHandler& handler, PairMemory& memory,
                                  const StartWorlds& startWorlds, double seconds, QueryWork& work);
    /// What becomes of free bodies that these have moved: what a motion moves keeps its pace when it is let go, what a
    /// hand puts somewhere is at rest there. Velocities that change, ascending by core.
    [[nodiscard]] static std::vector<BodyVelocity> letGo(const ObjectHandler& handler,
                                                         std::initializer_list<std::span<const Mover>> movers,
                                                         double seconds);
    /// After the step: poses as they are left behind.
    void end(ObjectHandler& handler, std::span<const BodyVelocity> velocities);

private:
    /// A free body. Its terms are those that the last frame left.
    struct Known {
        ObjectId core;
        std::uint32_t body = kNobody;  // the handler's number for it now
        bool asleep = false;
        bool disturbed = false;         // the stage does not know yet
        std::uint64_t poseVersion = 0;  // the sum over its parts: changes when one does
        Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
        double mass = 0, restitution = 0, friction = 0;
    };
    struct Sleepers;

    [[nodiscard]] static std::uint64_t versionOf(const ObjectHandler& handler, const Body& body);
    void attach(std::uint32_t body, const ObjectHandler& handler, bool disturbed);
    void forget(std::uint32_t slot);
    [[nodiscard]] bool mayMeet(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds) const;
    void gather(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds, double seconds);
    RigidBody& nextBody(std::uint32_t number);
    void give(const ObjectHandler& handler, std::uint32_t body);
    void describe(const ObjectHandler& handler, std::uint32_t body, RigidBody& rigid,
                  std::vector<RigidPart>& parts) const;
    static void describePart(const ObjectHandler& handler, std::uint32_t part, const StartWorlds& startWorlds,
                             double seconds, RigidBody& rigid, RigidPart& rigidPart);
    std::uint32_t rigidPart(const ObjectHandler& handler, std::uint32_t part, const StartWorlds& startWorlds,
                            double seconds);

    RigidBodyStage stage_;
    std::vector<Known> known_;  // what has no core is nobody
    std::vector<std::uint32_t> freeSlots_;
    IdTable slotOfCore_;
    std::vector<std::uint32_t> slotOfBody_;  // per body of the handler; kNobody: not free
    std::vector<std::uint32_t> awake_, changed_, held_;
    std::vector<std::uint32_t> again_;  // bodies to be looked at when the next frame begins
    std::vector<std::uint32_t> now_;    // those that were in this one
    bool allAsleep_ = false, unchanged_ = false;
    bool told_ = false;                // the stage knows of the last change
    std::vector<ObjectId> supportOf_;  // per part of the handler: the node that sleepers may lean on, or none
    std::vector<ObjectId> suspects_;   // of those: may be elsewhere, or gone
    Vec3d gravity_ = Vec3d::Zero();    // when the stage last ran
    bool rulesChanged_ = false;
    std::vector<std::pair<ObjectId, std::int64_t>> responses_;  // of the interests of the last frame
    std::uint64_t interestsVersion_ = 0, generation_ = 0;
    // Kept for their memory.
    std::vector<RigidBody> bodies_;
    std::vector<RigidPart> parts_;
    std::vector<RigidEncounter> encounters_;
    std::vector<std::uint32_t> bodyOf_;       // per body in bodies_: a free one's number, or kNobody
    std::vector<std::uint32_t> rigidPartOf_;  // per part of the handler; kNobody
    std::vector<std::uint32_t> given_;        // parts that have one
};

}  // namespace tessera
