/// CGAL 5.5 as the oracle: exact predicates, none of our code but the meshes. Its headers are unpacked by
/// deploy/set-up; where they are missing, tests that ask it skip themselves and say so.
#pragma once

#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera::cgal {

[[nodiscard]] bool available();

/// Every pair of triangles that meet, ascending: A's as they are, B's with their vertices mapped to A's frame in
/// double. Triangles must have area.
[[nodiscard]] std::vector<FacePair> intersectingPairs(const TriangleMesh& a, const TriangleMesh& b,
                                                      const Affine3d& a_T_b);

/// The distance of the same two sets of triangles, each pair's in exact arithmetic where it may be the least one; to
/// rounding of its square root. 0 where some meet. `atMost`: an upper bound known from elsewhere; it saves time and,
/// where it is too low, is answered by infinity.
[[nodiscard]] double distance(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b, double atMost);

/// How far a point is off a triangle, in double.
[[nodiscard]] double distance(const Vec3d& point, const Triangle& triangle);

}  // namespace tessera::cgal
