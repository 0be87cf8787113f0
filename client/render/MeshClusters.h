/// Large meshes in parts that are culled by themselves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Frustum.h"

namespace tessera {

/// A box in the mesh's own coordinates around a run of its triangles, in the order of its indices.
struct MeshCluster {
    static constexpr std::size_t kTriangles = 256;  ///< in each but the last
    Vec3f centre, half;
};

/// Empty for a mesh that is small, or whose order makes no compact parts. The mesh has passed checkMesh.
[[nodiscard]] std::vector<MeshCluster> clustersOf(std::span<const float> positions,
                                                  std::span<const std::uint32_t> indices);

struct TriangleRun {
    std::uint32_t first = 0, count = 0;
};
/// Appends the runs of triangles of which something may lie in a frustum, ascending and apart.
void runsInFrustum(std::span<const MeshCluster> clusters, std::uint32_t triangles, const Frustum& frustum,
                   const Affine3d& frustum_T_mesh, std::vector<TriangleRun>& runs);

}  // namespace tessera
