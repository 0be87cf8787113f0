/// Divides a mesh into wide nodes: which triangles share a leaf, which subtrees share a node.
#pragma once

#include <cstdint>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/tree/KernelTypes.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

struct TreeTopology {
    std::vector<kernel::ChildRef> children;  ///< kWidth per node; node 0 has one child, the whole
    std::vector<std::uint32_t> leafFaces;    ///< kLeafFaces per leaf; a subtree's leaves are consecutive
    std::size_t depth = 0;
};

/// Deterministic; its depth is bounded for any input. Coordinates are rounded as (x - centre) · unit.
[[nodiscard]] TreeTopology divide(const TriangleMesh& mesh, const Vec3d& centre, double unit, SplitRule rule);

}  // namespace tessera
