/// Which of a frame's wishes can be granted at all.
#pragma once

#include <span>
#include <vector>

#include "server/collision/pipeline/StepResult.h"
#include "server/collision/response/Way.h"

namespace tessera {

/// A wish that can be granted, and the way it asks for.
struct Mover {
    TentativeTransform wish;
    Way way;
    std::uint32_t number = kNobody;  ///< the transform's, by the handler
};

[[nodiscard]] TentativeTransform withValue(TentativeTransform t, const Pose& value);

/// Leaves transforms where they are committed, where what a step has come to is nothing that they can say (numbers that
/// are not finite, a rotation that is none), and names them.
[[nodiscard]] std::vector<ObjectId> holdBack(std::vector<TentativeTransform>& accepted, const Aspect& committed);
/// Cuts velocities to CollisionObject::kFastest, what is not finite to none, and names the nodes of those bodies.
[[nodiscard]] std::vector<ObjectId> holdBack(std::vector<BodyVelocity>& velocities, const Aspect& committed);

/// Sorts the wishes, takes the first of those for one transform (lowest source, then lowest numbers), refuses
/// impossible ones, grants those that move no part of any interest, and leaves the others in `movers`, ascending by
/// transform.
void admit(const Aspect& committed, const ObjectHandler& handler, std::span<const TentativeTransform> wanted,
           StepResult& result, std::vector<Mover>& movers);

}  // namespace tessera
