/// Hulls, which are solid: against each other by their supports, against surfaces by their faces and their insides.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::hull_pairs {

TouchMethod touch;
ContactsMethod contacts;
/// The faces named are none (kWhole).
DistanceMethod distance;
DepthMethod depth;

// One of the two is a hull, the other a surface; in either order.
TouchMethod touchSurface;
ContactsMethod contactsWithSurface;
DistanceMethod distanceToSurface;
/// What is found of their surfaces; 0 where the surface is within the hull.
[[nodiscard]] Distance orWithin(Distance ofSurfaces, const CollisionShape& a, const CollisionShape& b,
                                const Affine3d& a_T_b, QueryWork& work);

}  // namespace tessera::hull_pairs
