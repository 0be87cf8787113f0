/// How far are two bodies apart, and where are they nearest?
#pragma once

#include <limits>
#include <optional>

#include "common/math/Types.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

struct DistanceOptions {
    /// Of no interest from here on: the answer is `farther` where nothing is nearer.
    double upperBound = std::numeric_limits<double>::infinity();
    /// The answer may be larger than the true distance by this much (never smaller): 0 is exact to rounding.
    double tolerance = 0;
    /// Where to look first: the nearest faces of the last frame. A hint: it changes no answer but the choice among
    /// equally near pairs.
    std::optional<FacePair> start;
};

struct Distance {
    /// 0 where they intersect (by trianglesIntersect, as every query). In A's units.
    double distance = std::numeric_limits<double>::infinity();
    FacePair faces;
    Vec3d onA = Vec3d::Zero(), onB = Vec3d::Zero();  ///< in A's frame
    bool farther = false;  ///< nothing is nearer than the upper bound (or a mesh is empty); distance is the bound then
    bool complete = true;  ///< false: the work was exhausted; distance is then a *lower* bound and says nothing else
    /// Of approximations (../pairwise), in A's units: the truth is within this of `distance`.
    double error = 0;
};

/// The nearest points of two bodies. Of trees with volumes of two shapes the smaller mesh is divided anew, in the kind
/// of the other tree, which costs a build. `a_T_b`: any finite affine map from B's frame to A's.
[[nodiscard]] Distance distanceBetween(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                       QueryWork& work, const DistanceOptions& options = {});

}  // namespace tessera
