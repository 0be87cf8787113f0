/// How deep is the origin in a Minkowski difference?
#pragma once

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/convex/Simplex.h"

namespace tessera {

struct DepthOfOrigin {
    double depth = 0;
    Vec3d normal = Vec3d::UnitX();  ///< outwards: the difference ends at depth along it
    Vec3d onA = Vec3d::Zero(), onB = Vec3d::Zero();
    bool complete = true;
};

/// The origin is in the difference, or as near as rounding can tell. `start`: some of its corners, one at least.
///
/// A polytope inside the difference grows where its surface is nearest to the origin, until it cannot (van den Bergen
/// 2001). It is the exact hull of its rounded corners, so its surface stays closed and convex whatever rounding did.
/// The origin need not be in it at first: sides that it lies outside of count as nearest of all.
[[nodiscard]] DepthOfOrigin depthOfOrigin(const MinkowskiDifference& difference, const Simplex& start, ConvexWork& work,
                                          const HullDepthOptions& options);

}  // namespace tessera
