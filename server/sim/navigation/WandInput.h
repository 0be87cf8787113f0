/// Wands move the wall as windows do.
#pragma once

#include "common/request/StatusRequests.h"
#include "server/sim/navigation/NavigationInput.h"

namespace tessera {

/// A wand's stick: to the sides turns (axis 0), forwards goes where the wand points (axis 1, in the wall's frame). A
/// tenth around the middle is no wish. Buttons are the applications', and the first one takes hold of handles
/// (HandleInput.h). A wand that is not tracked wants nothing.
[[nodiscard]] NavigationInput inputOf(const WandState& wand);

}  // namespace tessera
