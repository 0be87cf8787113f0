/// Triangles against triangles: the entry that every other may fall back to.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::surface_pairs {

TouchMethod touch;
ContactsMethod contacts;
DistanceMethod distance;
FirstContactMethod firstContact;
DepthMethod depth;

}  // namespace tessera::surface_pairs
