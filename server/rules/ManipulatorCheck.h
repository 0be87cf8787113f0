/// Whether manipulators that a list touches have something to move.
#pragma once

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Of manipulators as the list leaves them behind: one without a target passes, and so does one whose target gets
/// another core later (it shows nothing until it is right again). A target that a list says must be a node with what
/// the kind moves. Costs a look-up per entry.
[[nodiscard]] Sound checkManipulators(const Aspect& scene, const ChangeList& list);

}  // namespace tessera
