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

/// What a hull beside points is: as a solid it touches what is inside, and its face is kWhole.
enum class Hulls { kSurfaces, kSolids };

/// One of the two is a set of points, or both are.
template <Hulls kHulls>
struct Methods {
    static TouchMethod touch;
    static ContactsMethod contacts;
    static DistanceMethod distance;
    static FirstContactMethod firstContact;
    /// Of the pair that is deepest in each other: the sum of the radii less the distance of the centres, or of the
    /// centre and the triangle.
    static DepthMethod depth;
};

/// Of one pair that touches in these poses. Of a cover's ball the face is one of the surface in it.
[[nodiscard]] PairContact contact(const PlacedShape& a, const PlacedShape& b, const FacePair& faces);

/// Where a direction of the world leaves the octahedron of a point (of no cover): face 8 · point + octant, and the
/// place on it.
struct OnOctahedron {
    std::uint32_t face = 0;
    Vec2d uv = Vec2d::Zero();
};
[[nodiscard]] OnOctahedron octahedronAt(const PlacedShape& points, std::uint32_t point, const Vec3d& direction);

}  // namespace tessera::point_pairs
