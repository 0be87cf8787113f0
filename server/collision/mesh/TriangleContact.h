/// Where two triangles meet, in words a response can use: a point and a normal. Computed in ordinary double: what the
/// exact predicate decides is *whether*, this is *where*, to rounding.
#pragma once

#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

struct TriangleContact {
    Vec3d from,
        to;  ///< the segment in which they meet; equal ends for a point; the longest way across for coplanar overlap
    Vec3d point;   ///< its middle
    Vec3d normal;  ///< unit length, from A to B: the way in which B has to go to be free of A
};

/// The contact of two triangles that meet. Winding matters: corners run counter-clockwise seen from outside.
///
/// Normal: of A's outside and the reverse of B's outside, the one along which B has the shorter way to be free of A;
/// both together where they are equally long. (Edges are not crossed: two triangles cannot tell a ridge from the
/// diagonal of a flat wall.) `contactOf(b, a)` has the opposite normal, but for coplanar triangles that look the same
/// way (no side is the outer one; A's normal is taken). For triangles that do not quite meet: the contact between their
/// nearest points.
[[nodiscard]] TriangleContact contactOf(const Triangle& a, const Triangle& b);

struct NearestPoints {
    Vec3d onA, onB;
    double distance = 0;
};

/// Nearest points of the edges and corners of one to the other; of two triangles that do not meet, the nearest points.
[[nodiscard]] NearestPoints nearestPoints(const Triangle& a, const Triangle& b);

/// Of the closed segments p1 q1 and p2 q2; points are segments too.
[[nodiscard]] NearestPoints nearestOnSegments(const Vec3d& p1, const Vec3d& q1, const Vec3d& p2, const Vec3d& q2);
/// Of a triangle to `p`; right to rounding of the coordinates for triangles that are thin or without area, too.
[[nodiscard]] Vec3d nearestOnTriangle(const Triangle& t, const Vec3d& p);

/// The unit normal on the side from which the corners run counter-clockwise; zero where there is no area.
[[nodiscard]] Vec3d outside(const Triangle& t);

/// How far B would have to go along a unit direction to leave A behind; below 0: it has left it by so much.
[[nodiscard]] double wayOut(const Triangle& a, const Triangle& b, const Vec3d& direction);

}  // namespace tessera
