/// Puts bounding volumes around the triangles of a divided mesh.
#pragma once

#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

/// Fills corners, volumes, radius and cost from children, leafFaces and the mesh's vertices in the tree's coordinates.
/// Volumes hold the exact triangles: what rounding can do is added to them (kernel/Fit.inl).
void fitVolumes(TreeStorage& tree, std::span<const OwnPosition> positions, InstructionSet set = instructionSet());

/// The same of what is above the vertices [first, first + count), whose positions in the mesh are new. False, and
/// nothing has changed, where all had better be fitted: too much would be, or the tree's coordinates fit no more.
[[nodiscard]] bool fitSome(TreeStorage& tree, std::size_t first, std::size_t count,
                           InstructionSet set = instructionSet());

}  // namespace tessera
