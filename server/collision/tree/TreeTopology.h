/// Divides a mesh into wide nodes: which triangles share a leaf, which subtrees share a node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

struct TreeTopology {
    std::vector<kernel::ChildRef>
        children;  ///< kWidth per node; node 0 has one child, the whole; children come after their node
    std::vector<std::uint32_t> leafFaces;  ///< kLeafFaces per leaf; a subtree's leaves are consecutive
    std::size_t depth = 0;
};

/// Deterministic, the same on every processor; its depth is bounded for any input. Three indices into `positions` per
/// triangle.
[[nodiscard]] TreeTopology divide(std::span<const OwnPosition> positions, std::span<const std::uint32_t> indices,
                                  SplitRule rule, InstructionSet set = instructionSet());

}  // namespace tessera
