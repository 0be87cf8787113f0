/// Spherical fields against triangles and each other: which faces meet, looked up by directions. The answers of the
/// same triangles' trees.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::spherical_pairs {

// One of the two has a spherical field, or both have; the other is taken by its triangles. Beside what deforms the
// trees are asked: a field would want another tree of it refitted.
TouchMethod touch;
ContactsMethod contacts;

}  // namespace tessera::spherical_pairs
