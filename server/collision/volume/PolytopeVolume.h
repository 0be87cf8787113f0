/// How much room a k-DOP takes: what a realignment has lost, as a number. Too dear for every pair of volumes.
#pragma once

#include "server/collision/volume/KDop.h"

namespace tessera {

/// Of the points that all slabs hold, in units cubed; slabs that nothing else needs do not count. 0 of what is flat or
/// empty.
[[nodiscard]] double polytopeVolume(const KDop& dop);

}  // namespace tessera
