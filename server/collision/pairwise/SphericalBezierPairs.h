/// Spherical Bézier patches: with each other and with triangles. They tell that two are apart; all else their triangles
/// tell.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::spherical_bezier_pairs {

// One of the two is looked at by patches, or both are; of triangles without patches the ball around their box is
// compared.
TouchMethod touch;
ContactsMethod contacts;

}  // namespace tessera::spherical_bezier_pairs
