/// A Bézier patch near a subdivision surface where that is no polynomial.
///
/// Quadrilaterals: Loop and Schaefer 2008, "Approximating Catmull-Clark subdivision surfaces with bicubic patches".
/// Triangles: the box spline's masks inside, limit points and tangents at the corners. How near is PatchExtraction's to
/// say: nothing here is a bound. Pure.
#pragma once

#include <array>
#include <optional>

#include "common/freeform/subdivision/CornerLimit.h"

namespace tessera {

/// Rows for 16 points, u fastest, or 15 as BezierTriangle has them, by the neighbourhood's points; nothing where a face
/// around is of another size or sharpness runs out: refinement leads to better places. `limits`: of the face's corners.
[[nodiscard]] std::optional<SparseRows> approximatePatchOf(const TaggedMesh& neighbourhood, SubdivisionScheme scheme,
                                                           std::span<const CornerLimit* const> limits);

}  // namespace tessera
