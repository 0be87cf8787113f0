/// Which of a frame's wishes can be granted at all.
#pragma once

#include <vector>

#include "server/collision/pipeline/StepResult.h"
#include "server/collision/response/Way.h"

namespace tessera {

/// A wish that can be granted, and the way it asks for.
struct Mover {
    TentativeTransform wish;
    Way way;
};

[[nodiscard]] TentativeTransform withValue(TentativeTransform t, const Pose& value);

/// Sorts the wishes, takes the first of those for one transform (lowest source, then lowest numbers), refuses impossible ones,
/// grants those that move no part of any interest, and returns the others, ascending by transform.
[[nodiscard]] std::vector<Mover> admit(const Aspect& committed, const ObjectHandler& handler,
                                       std::vector<TentativeTransform> wishes, StepResult& result);

}  // namespace tessera
