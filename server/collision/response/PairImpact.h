/// When do two parts first touch, while everything that moves is on its way?
#pragma once

#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/response/Way.h"

namespace tessera {

/// The first contact of two parts within a frame's motion: every transform goes its whole way (or stands still where
/// `wayOf` knows none) as the same fraction of the frame passes, whatever stands above whom; a part that the handler says
/// deforms goes with its vertices. As `timeOfImpact`: never late, `distance` at t within the tolerance (world units), hull
/// shapes by their surfaces. `normal` and `point` in the world.
[[nodiscard]] Impact firstContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, const WayLookup& wayOf,
                                  double tolerance, QueryWork& work);

}  // namespace tessera
