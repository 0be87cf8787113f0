/// Triangles divided into the nodes and leaves of a RayTree. Inside of this library only.
#pragma once

#include <span>
#include <vector>

#include "common/rays/RayKernels.h"

namespace tessera::rays {

struct Divided {
    std::vector<Node> nodes;
    std::vector<Leaf> leaves;
    std::uint32_t root = kNoChild;  ///< kNoChild: no face can be met
    std::size_t faces = 0;
    float reach = 0;  ///< no coordinate is larger
};

/// Top down by the surface-area heuristic over 16 bins (I. Wald, "On fast Construction of SAH-based Bounding Volume
/// Hierarchies", 2007), with a leaf's triangles counted in fours; eight ranges to a node, of which the one with the
/// largest surface is divided next (I. Wald, C. Benthin, S. Boulos, "Getting Rid of Packets", 2008).
[[nodiscard]] Divided divide(std::span<const float> positions, std::span<const std::uint32_t> indices);

}  // namespace tessera::rays
