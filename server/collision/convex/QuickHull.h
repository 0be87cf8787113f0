/// The convex hull of points that do not all lie in one plane, as triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Types.h"

namespace tessera {

struct HullSurface {
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
    /// The triangle behind the edge from corner i to corner i + 1.
    std::vector<std::array<std::uint32_t, 3>> across;
};

/// Closed: every directed edge occurs once, its reverse once. No triangle is without area; several may lie in one
/// plane, and corners may lie inside an edge or a side of the hull.
///
/// C. B. Barber, D. P. Dobkin, H. Huhdanpaa, "The Quickhull Algorithm for Convex Hulls", 1996, with exact sides: a face
/// is replaced by a point's cone iff the point lies strictly outside it, so no thickness and no merging is needed.
/// `points` are distinct; the four of `start` do not lie in one plane. Work O(n log n) for points as they come.
[[nodiscard]] HullSurface quickHull(std::span<const Vec3d> points, std::array<std::uint32_t, 4> start);

}  // namespace tessera
