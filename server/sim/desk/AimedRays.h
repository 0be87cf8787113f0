/// From what somebody aims with to a ray in the world.
#pragma once

#include <string>

#include "common/wall/View.h"
#include "server/sim/desk/DeskSurroundings.h"

namespace tessera {

/// Through a pixel of the wall, as its users see it in the newest frame.
[[nodiscard]] Expected<Ray> rayThrough(const DeskSurroundings& around, double xPx, double yPx);
/// Where a wand points in the newest frame. kNotFound: the wall has no such wand. kRefused: it is not tracked.
[[nodiscard]] Expected<Ray> rayAlong(const DeskSurroundings& around, const std::string& wand);

}  // namespace tessera
