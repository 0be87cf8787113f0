/// Distance fields: how far, and how deep, to the error that the field was made for. What touches is asked of the
/// trees.
#pragma once

#include "server/collision/pairwise/PairTable.h"

namespace tessera::distance_field_pairs {

/// One of the two is a distance field, or both are; the other is taken by its triangles. Distances are those of the
/// surfaces: 0 where they meet and nowhere else (that is asked of the trees), more where one is within the other. Of
/// surfaces that are apart no faces are named (kWhole), and the points are near the nearest ones, as far as the error
/// lets them. Where no field serves (B's, where the map is no similarity), where the field does not reach, and beside
/// what deforms, the trees answer: exactly, with the error 0. A tolerance is not looked at.
DistanceMethod distance;
/// The other is a hull, which is solid.
DistanceMethod distanceToHull;
/// How deep the deepest point of one's surface is in the other, which is solid here: by so much they have to part at
/// least, in any direction. Of two fields each is looked for in the other; of one field what of the other is in it.
/// Of two that do not meet it is told, too, where one is within the other's field. A field within what is none is not
/// seen to be: 0, as of surfaces that are apart. Fields of open surfaces have no depth, nor have those whose lengths
/// the map to the world does not keep: then as surface_pairs::depth.
DepthMethod depth;

}  // namespace tessera::distance_field_pairs
