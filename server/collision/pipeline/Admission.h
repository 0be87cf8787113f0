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

/// Sorts the wishes, takes the first of those for one transform (lowest source, then lowest numbers), refuses
/// impossible ones, grants those that move no part of any interest, and leaves the others in `movers`, ascending by
/// transform.
void admit(const Aspect& committed, const ObjectHandler& handler, std::span<const TentativeTransform> wanted,
           StepResult& result, std::vector<Mover>& movers);

}  // namespace tessera
