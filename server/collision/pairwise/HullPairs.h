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

}  // namespace tessera::hull_pairs
