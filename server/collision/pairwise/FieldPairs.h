/// Height fields: with triangles, with hulls by their faces, with each other. The answers of the same triangles.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::field_pairs {

// One of the two is a height field, or both are; the other is taken by its triangles.
TouchMethod touch;
ContactsMethod contacts;
DistanceMethod distance;
FirstContactMethod firstContact;
/// A field encloses nothing: 0 where they are apart, else nothing.
DepthMethod depth;

}  // namespace tessera::field_pairs
