/// Which triangles of a mesh are near a place?
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// Appends, ascending, the faces whose boxes overlap `box` (in the mesh's frame). The same faces for every kind of
/// tree. False: the work was exhausted; nothing is appended.
[[nodiscard]] bool facesNear(const TriangleTree& tree, const Box& box, QueryWork& work,
                             std::vector<std::uint32_t>& faces);

}  // namespace tessera
