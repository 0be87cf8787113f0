/// Where two shapes meet: places on both surfaces, and the way in which they part.
#pragma once

#include <optional>

#include "server/collision/pairwise/PairTable.h"

namespace tessera {

struct PairContact {
    /// As they are drawn (CollisionShape::mesh): of points those of the octahedra around them,
    /// of a cover's ball a face in it.
    FacePair faces;
    Vec3d point = Vec3d::Zero();   ///< world
    Vec3d normal = Vec3d::Zero();  ///< world, of unit length, from A to B
    /// Along the normal, of the region or of the hulls that the contact belongs to; nothing where it is not known.
    std::optional<double> depth;
    /// The point on the face of each: corner 0 + u · (corner 1 - corner 0) + v · (corner 2 - corner 0). Of balls where
    /// the way from the centre to the point comes through the octahedron.
    Vec2d uvA = Vec2d::Zero(), uvB = Vec2d::Zero();
};

/// Of two faces that meet in these poses, by themselves (regionsOf knows better where all are known). The normal goes
/// to the world as planes do, which also rights it where a mirrored frame turned the winding. Of balls with depth.
[[nodiscard]] PairContact contactOfFaces(const PlacedShape& a, const PlacedShape& b, const FacePair& faces);
/// Of two faces of one shape's mesh.
[[nodiscard]] PairContact contactWithItself(const PlacedShape& shape, const FacePair& faces);
/// Of two hulls: the middle between the deepest points.
[[nodiscard]] PairContact contactOfHulls(const PlacedShape& a, const PlacedShape& b);

/// The face as it is drawn: of a point the one in a direction of the world, of a cover's ball one in it.
[[nodiscard]] std::uint32_t drawnFace(const PlacedShape& of, std::uint32_t face, const Vec3d& towards);

/// u and v of a point of a triangle, to rounding; of others, of some point of it.
[[nodiscard]] Vec2d placeOn(const Triangle& triangle, const Vec3d& point);

}  // namespace tessera
