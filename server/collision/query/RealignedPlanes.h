/// Three-plane weights (volume/Realignment.h) for the touch kernels, in the time that a query of a microsecond has for
/// them.
#pragma once

#include "server/collision/tree/KernelTypes.h"
#include "server/collision/volume/Realignment.h"

namespace tessera {

/// What realigns k-DOPs of one frame to the same directions of another. For volumes no point of which is farther from
/// the origin than `radius`, and maps that stretch no length more than `stretch`; all well inside what a float can
/// hold. Every bound that a kernel makes of this in float holds all points, mapped exactly.
void realignPlanes(kernel::Realigned& out, DirectionSet set, const Affine3d& to_T_from, double radius, double stretch,
                   PlaneChoice choice);

}  // namespace tessera
