/// From what somebody aims with to a ray in the world.
#pragma once

#include <string>

#include "common/wall/View.h"
#include "server/sim/desk/DeskSurroundings.h"

namespace tessera {

/// Through a pixel of the wall, as its users see it in the newest frame; where a wand points in it; or the ray itself.
/// kNotFound: the wall has no such wand. kRefused: it is not tracked.
[[nodiscard]] Expected<Ray> rayOf(const DeskSurroundings& around, const Aim& aim);

}  // namespace tessera
