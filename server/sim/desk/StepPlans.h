/// What a step of undo or redo would do, in words, before it is asked for.
#pragma once

#include "common/request/EditRequests.h"

namespace tessera {

class Simulation;

/// What the next undo would do. Looks at some hundred rows of the first lists, however large they are: what is not
/// looked at is "more". Of a step in parts, such as a large load, the nodes on top are named.
[[nodiscard]] answer::StepPlan undoPlan(const Simulation& simulation);
/// The same of the next redo.
[[nodiscard]] answer::StepPlan redoPlan(const Simulation& simulation);

}  // namespace tessera
