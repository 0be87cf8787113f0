/// How far points are from a frame's origin, and bounds on how they move there while transforms are on their ways.
#pragma once

#include "server/collision/response/Way.h"

namespace tessera {

/// Derivatives are by the fraction of the way (0 to 1).
struct Reach {
    double radius = 0;
    double speed = 0;         ///< first derivative
    double acceleration = 0;  ///< second, everything on one fraction
    double bow = 0;           ///< second, summed over the places' own fractions
    double drift = 0;         ///< how far the translations alone carry a point
};

/// Of what is `below` a moving transform, in the frame above it.
[[nodiscard]] Reach onWay(const Reach& below, const Way& way);
/// The same for a map that stands still.
[[nodiscard]] Reach through(const Reach& below, const Affine3d& fixed);

/// The largest distance of a box's corners, mapped, from the origin.
[[nodiscard]] double radiusOf(const Box& box, const Affine3d& map);

}  // namespace tessera
