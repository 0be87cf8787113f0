/// How far does a k-DOP itself reach? For tests and for judging other bounds: too dear for every pair of volumes.
#pragma once

#include "server/collision/volume/KDop.h"

namespace tessera {

/// max x·p over the points of a k-DOP that is not empty: a linear programme, solved by the simplex method on its dual
/// from the planes that Realignment.h would choose, so the result is never below the maximum but by rounding, and never
/// above theirs. -infinity where the slabs have no point in common.
[[nodiscard]] double polytopeSupport(const KDop& dop, const Vec3d& p);

}  // namespace tessera
