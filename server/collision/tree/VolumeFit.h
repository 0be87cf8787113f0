/// Puts bounding volumes around the triangles of a divided mesh.
#pragma once

#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

/// Fills corners, volumes, radius and cost from children, leafFaces and the mesh's vertices in the tree's coordinates. Volumes
/// hold the exact triangles: what rounding can do is added to them (kernel/Fit.inl).
void fitVolumes(TreeStorage& tree, std::span<const OwnPosition> positions, InstructionSet set = instructionSet());

}  // namespace tessera
