/// GJK's descent to the point of a Minkowski difference that is nearest to the origin: what hullsTouching, hullDistance
/// and hullDepth have in common.
#pragma once

#include "server/collision/convex/Simplex.h"
#include "server/collision/mesh/TriangleContact.h"

namespace tessera {

enum class DescentEnd : std::uint8_t {
    kApart,    ///< a plane lies between the hulls; with `nearest`: and the simplex is the nearest one, to rounding
    kMeet,     ///< the origin is in the simplex, or (from exact arithmetic) in what it is a part of
    kUnknown,  ///< exhausted, or not finite; `lowerBound` still holds
};

struct DescentResult {
    DescentEnd end = DescentEnd::kUnknown;
    Simplex simplex;
    SimplexNearest nearest;
    double lowerBound = 0;            ///< of the distance
    bool exact = false;               ///< decided in exact arithmetic
    std::array<double, 4> weights{};  ///< with `exact` and kMeet: the simplex times these is the origin
};

/// Never wrong: where double leaves a doubt, the exact descent decides. `nearest`: go on until the distance is known.
[[nodiscard]] DescentResult descend(const MinkowskiDifference& difference, bool nearest, ConvexWork& work,
                                    ConvexCache* cache);

/// The pair of points, one of A's and one of B's, that are nearest in the hulls of what a simplex came from.
[[nodiscard]] NearestPoints nearestOf(const Simplex& simplex);

}  // namespace tessera
