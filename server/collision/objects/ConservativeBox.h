/// Boxes that hold what rounding makes of a body.
#pragma once

#include "common/math/Box.h"

namespace tessera {

/// The box around a box seen in another frame, grown so that it holds every vertex as rounding will put it there.
[[nodiscard]] Box boxAround(const Affine3d& to_T_from, const Box& box);
/// The same for points that lie in both the box (not empty) and the ball.
[[nodiscard]] Box boxAround(const Affine3d& to_T_from, const Box& box, const Vec3d& ballCentre, double ballRadius);

}  // namespace tessera
