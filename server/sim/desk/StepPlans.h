/// What a step of undo or redo would do, in words, before it is asked for.
#pragma once

#include <span>

#include "common/request/EditRequests.h"
#include "common/scene/Aspect.h"

namespace tessera {

class Simulation;

/// Lists of a step that are looked at.
inline constexpr std::size_t kMostStepLists = 8;

/// `lists`: the first of that step, as it applies them. Looks at some hundred rows of each, however large they are:
/// what is not looked at is "more".
[[nodiscard]] answer::StepPlan stepPlan(const Simulation& simulation, std::span<const ChangeListPtr> lists);

}  // namespace tessera
