/// Which maps queries can work with, and boxes that hold what rounding makes of a body under them.
#pragma once

#include <optional>

#include "common/math/Box.h"

namespace tessera {

/// Whether queries can work with this map: finite, and far enough from flat that it has an inverse.
[[nodiscard]] bool invertible(const Affine3d& m);

/// The factor by which a similarity stretches lengths; nothing for other maps.
[[nodiscard]] std::optional<double> similarityScale(const Affine3d& m);

/// The box around a box seen in another frame, grown so that it holds every vertex as rounding will put it there.
[[nodiscard]] Box boxAround(const Affine3d& to_T_from, const Box& box);
/// The same for points that lie in both the box (not empty) and the ball.
[[nodiscard]] Box boxAround(const Affine3d& to_T_from, const Box& box, const Vec3d& ballCentre, double ballRadius);

}  // namespace tessera
