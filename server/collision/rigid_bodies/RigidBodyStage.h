/// Free bodies: how gravity, contacts and friction move them in one frame.
///
/// A function of what it is given and of what it remembers of the frames before (impulses to start from, who sleeps):
/// no scene, no clock, no threads of its own. Answers do not depend on the number of workers or on the processor.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

class Workers;

/// One surface, in place as the frame begins.
struct RigidPart {
    std::uint64_t id = 0;                ///< stable from frame to frame, unique
    std::uint32_t body = 0;              ///< index into the bodies
    const TriangleTree* tree = nullptr;  ///< its surface; stays alive and unchanged as long as the part is passed
    const ConvexHull* hull = nullptr;    ///< not null: solid and convex, and `tree` is its surface
    Affine3d world = Affine3d::Identity();
};

struct RigidBody {
    std::uint64_t id = 0;  ///< stable from frame to frame, unique
    double mass = 0;       ///< 0: nothing here moves it
    double restitution = 0.2, friction = 0.5;
    /// Of the centre of mass; of a body without mass: of its parts' points, velocity + spin × (point - anchor), for the
    /// coming frame.
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
    Vec3d anchor = Vec3d::Zero();
    bool disturbed = false;  ///< somebody else has set its pose, shape, mass or velocity: it may not sleep on
    std::vector<std::uint32_t> parts;
};

enum class ContactLaw : std::uint8_t {
    kStick,   ///< no bounce, no sliding: stop
    kSlide,   ///< no bounce, no friction
    kBounce,  ///< restitution and friction of the two
};

/// Two parts of different bodies, one of them free, that may come to touch in the coming frame.
struct RigidEncounter {
    std::uint32_t partA = 0, partB = 0;
    ContactLaw law = ContactLaw::kBounce;
};

struct RigidMotion {
    Isometry3d world_T_before =
        Isometry3d::Identity();  ///< from where the body was to where it is now; of a sleeper exactly the identity
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
    bool asleep = false;
};

struct RigidFrame {
    /// Per body that was passed, then per one that was fetched; of bodies without mass nothing.
    std::vector<RigidMotion> motions;
    std::vector<std::uint64_t> fetched;   ///< bodies
    std::vector<std::uint64_t> supports;  ///< parts of bodies without mass that somebody has begun to sleep on
    std::size_t contactPoints = 0;
    std::size_t asleep = 0;  ///< passed or not
    /// Encounters whose contacts a limit left unknown: their free bodies stay where they are in this frame.
    struct Left {
        std::uint64_t partA = 0, partB = 0;
    };
    std::vector<Left> notLookedAt;
};

/// Who is asked for bodies that were not passed, because they slept, and are woken.
class RigidSource {
public:
    virtual ~RigidSource() = default;
    /// A free body, as it would be passed (its `parts` are not looked at); false where it is none any more.
    [[nodiscard]] virtual bool body(std::uint64_t id, RigidBody& body, std::vector<RigidPart>& parts) = 0;
    /// The body of a part that sleepers lean on.
    [[nodiscard]] virtual bool support(std::uint64_t part, RigidBody& body, std::vector<RigidPart>& parts) = 0;
};

struct RigidOptions {
    int iterations = 12;
    double secondsToSleep = 0.5;
    /// In sizes of the smaller body: how deep bodies at rest lie in each other, so that they are found to touch.
    double slop = 2e-3;
    std::uint64_t maxTestsPerEncounter = 200'000;
};

/// Not thread-safe; `workers` may be null.
class RigidBodyStage {
public:
    explicit RigidBodyStage(RigidOptions options = {}, Workers* workers = nullptr);
    ~RigidBodyStage();
    RigidBodyStage(RigidBodyStage&&) noexcept;
    RigidBodyStage& operator=(RigidBodyStage&&) noexcept;

    /// How far beyond its parts' boxes the encounters of a body that moves like this must be looked for, in world
    /// units.
    [[nodiscard]] static double reach(const RigidBody& body, double size, const Vec3d& gravity, double seconds);
    /// Who slept at the end of the last frame. Sleepers about whom nothing has changed may be left out, with their
    /// encounters among each other and with bodies that stand still: they sleep on. What is disturbed is passed.
    [[nodiscard]] bool asleep(std::uint64_t body) const;
    /// A part of a body without mass that sleepers lean on. It may be left out as they may; pass it where it is, or may
    /// be, elsewhere: those who leaned on it wake.
    [[nodiscard]] bool supports(std::uint64_t part) const;
    /// All of them, ascending.
    [[nodiscard]] std::vector<std::uint64_t> supports() const;
    /// A body is not free any more, or a part is not there: in the next frame those who slept with or on it wake.
    void gone(std::uint64_t id);

    /// `source` may be null where nobody is left out.
    [[nodiscard]] RigidFrame advance(std::span<const RigidBody> bodies, std::span<const RigidPart> parts,
                                     std::span<const RigidEncounter> encounters, const Vec3d& gravity, double seconds,
                                     QueryWork& work, RigidSource* source = nullptr);

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tessera
