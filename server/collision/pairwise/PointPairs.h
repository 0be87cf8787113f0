/// Sets of points, each with a radius: against triangles, height fields, hulls and each other.
///
/// A shape's faces are its points; contacts, distances and first contacts are those of the balls. Balls of A are balls
/// in A's frame, whatever map has brought it to the world. Those of B are, where a_T_b is a similarity; any other map
/// makes ellipsoids of them, and then they are taken for the balls around these: what is said to touch may be apart by
/// the difference, and nothing that touches is missed. The questions of PairTable.h therefore ask in the frame of the
/// points.
#pragma once

#include "server/collision/pairwise/PairContact.h"
#include "server/collision/pairwise/PairTable.h"

namespace tessera::point_pairs {

/// One of the two is a set of points, or both are; of a hull the surface.
[[nodiscard]] PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                              const PairEffort& effort);
[[nodiscard]] PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                 std::size_t most, const PairEffort& effort);
[[nodiscard]] Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                QueryWork& work, const DistanceOptions& options);
[[nodiscard]] Impact firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options);
/// Of the pair that is deepest in each other: the sum of the radii less the distance of the centres, or of the centre
/// and the triangle.
[[nodiscard]] PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

/// The same with a hull as a solid: what is inside touches. Its face is kWhole.
[[nodiscard]] PairTouch touchHull(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                  const PairEffort& effort);
[[nodiscard]] PairTouch contactsWithHull(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                         std::size_t most, const PairEffort& effort);
[[nodiscard]] Distance distanceToHull(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                      QueryWork& work, const DistanceOptions& options);
[[nodiscard]] Impact firstContactWithHull(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                                          const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options);
[[nodiscard]] PairDepth depthInHull(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

/// Of one pair that touches in these poses.
[[nodiscard]] PairContact contact(const PlacedShape& a, const PlacedShape& b, const FacePair& faces);

/// Where a direction of the world leaves the octahedron of a point: face 8 · point + octant, and the place on it.
struct OnOctahedron {
    std::uint32_t face = 0;
    Vec2d uv = Vec2d::Zero();
};
[[nodiscard]] OnOctahedron octahedronAt(const PlacedShape& points, std::uint32_t point, const Vec3d& direction);

}  // namespace tessera::point_pairs
