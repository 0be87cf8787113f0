/// Surfaces cut at planes.
#pragma once

#include <cstddef>
#include <span>

#include "common/base/Error.h"
#include "common/geometry/Mesh.h"

namespace tessera {

/// So many planes at once.
inline constexpr std::size_t kMostCutPlanes = 64;

/// What of a surface lies where n·x <= d for each plane (n, d; |n| > 0), in the mesh's coordinates: triangles that are
/// whole stay as they are, in their order, others become what is left of them, and the cut is left open. Of triangles
/// with normals or without; sound (checkMesh), other arrays are left away. Places are found in double, from the end of
/// an edge that stays to the one that goes, and rounded once: whoever shares an edge shares its cut, so there are no
/// cracks. Normals are linear along edges, then of length 1; zero where they cancel. Costs a look at each corner and
/// plane. kLimit: more than `mostTriangles`, or more than kMostCutPlanes.
[[nodiscard]] Expected<MeshData> cutAtPlanes(const MeshArrays& mesh, std::span<const Vec4d> planes,
                                             std::size_t mostTriangles);

}  // namespace tessera
