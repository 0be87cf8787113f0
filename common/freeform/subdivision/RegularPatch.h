/// Where a subdivision surface is a polynomial patch: sixteen points of a bicubic B-spline, twelve of the quartic box
/// spline.
///
/// At boundaries and infinitely sharp creases the points beyond are extrapolated, such that the spline's own refinement
/// is the rule of the boundary: p(-1) = 2 p(0) - p(1) across a quadrilateral, a + b - c across a triangle. So these
/// faces are exact too. Pure.
#pragma once

#include <array>
#include <optional>

#include "common/freeform/subdivision/SparseRows.h"
#include "common/freeform/subdivision/TaggedMesh.h"

namespace tessera {

/// Points of the spline by the neighbourhood's points, if the face 0 is such a patch. Catmull-Clark: sixteen, u
/// fastest, the face's vertices at 5, 6, 10, 9. Loop: twelve, as kBoxSplinePoints has them.
[[nodiscard]] std::optional<SparseRows> regularPatchOf(const TaggedMesh& neighbourhood, SubdivisionScheme scheme);

/// In steps along the edges from vertex 0 to 1 and 0 to 2; the triangle's vertices are the first three.
inline constexpr std::array<std::array<int, 2>, 12> kBoxSplinePoints{
    {{0, 0}, {1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, -1}, {2, -1}, {2, 0}, {1, 1}, {0, 2}, {-1, 2}, {-1, 1}}};

/// The Bézier points of the same patch: bicubic, 16, u fastest.
[[nodiscard]] std::array<Vec3d, 16> bezierOfSpline(const std::array<Vec3d, 16>& points);
/// Quartic, 15, as BezierTriangle has them.
[[nodiscard]] std::array<Vec3d, 15> bezierOfBoxSpline(const std::array<Vec3d, 12>& points);

}  // namespace tessera
