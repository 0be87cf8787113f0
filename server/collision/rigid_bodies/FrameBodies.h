/// The bodies and parts of a frame in the order of their ids, checked, with what follows from their shapes.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "server/collision/rigid_bodies/MassProperties.h"
#include "server/collision/rigid_bodies/RigidBodyStage.h"
#include "server/collision/rigid_bodies/ShapeMemory.h"

namespace tessera::rigid {

inline constexpr std::uint32_t kNoBody = ~std::uint32_t{0};

/// By rank: the place in the order of ids. Nothing here depends on the order in which things were passed.
struct FramePart {
    const RigidPart* given = nullptr;
    std::uint32_t body = kNoBody;  ///< rank; kNoBody: meets nothing
    const SurfaceData* surface = nullptr;
    Box box;
};

struct FrameBody {
    const RigidBody* given = nullptr;
    std::uint32_t index = 0;  ///< into what was passed
    bool usable = false;      ///< has surfaces, all its numbers are numbers
    bool free = false;        ///< gives way
    bool moving = false;      ///< does not give way, and moves
    bool frozen = false;      ///< a limit left its contacts unknown: stays where it is
    bool asleep = false;
    double size = 0;   ///< the diagonal of its box
    double reach = 0;  ///< no point of it may go farther in the frame
    double restitution = 0, friction = 0;
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();  ///< within bounds
    MassProperties mass;                                   ///< of a free body; of others the centre is the anchor
};

struct FrameBodies {
    std::vector<FrameBody> bodies;
    std::vector<FramePart> parts;
    std::vector<std::uint32_t> bodyRank, partRank;  ///< of what was passed, by index

    /// A rank; kNoBody where no such part was passed.
    [[nodiscard]] std::uint32_t findPart(std::uint64_t id) const;
    [[nodiscard]] std::uint32_t findBody(std::uint64_t id) const;
    void gather(std::span<const RigidBody> given, std::span<const RigidPart> givenParts, const Vec3d& gravity,
                double seconds, ShapeMemory& shapes, std::uint64_t frame);

    /// One that comes later.
    struct Fetched {
        RigidBody body;
        std::vector<RigidPart> parts;
    };
    /// Who has which rank then, by what they had before.
    struct Ranks {
        std::vector<std::uint32_t> body, part;
        std::size_t parts = 0;
    };
    /// Of bodies none of which is here; their indices follow those of the others.
    [[nodiscard]] Ranks insert(std::vector<Fetched> some, const Vec3d& gravity, double seconds, ShapeMemory& shapes,
                               std::uint64_t frame);

private:
    std::deque<Fetched> fetched_;  ///< stay where they are
};

/// Of its size: what is added to the motion that is foreseen, for what other bodies do to one within a frame.
inline constexpr double kUnforeseen = 0.05;
/// Speeds beyond these are cut down to them: in units per second, and in turns that a frame can show.
inline constexpr double kMostSpeed = 1e6;
inline constexpr double kMostTurnPerFrame = 6.0;

}  // namespace tessera::rigid
