/// Do two triangles meet? The one predicate behind every collision query.
#pragma once

#include <array>

#include "common/math/Types.h"

namespace tessera {

using Triangle = std::array<Vec3d, 3>;

/// Exact on the coordinates given (see Predicates.h). Triangles are closed sets: touching counts, coplanar overlap
/// counts. A triangle without area is taken as what it is, a segment or a point. Symmetric; independent of the order
/// of the corners.
[[nodiscard]] bool trianglesIntersect(const Triangle& a, const Triangle& b);

/// No area: all three corners on one line, or in one point. Exact.
[[nodiscard]] bool isDegenerate(const Triangle& t);

}  // namespace tessera
