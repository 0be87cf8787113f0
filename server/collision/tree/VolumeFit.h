/// Puts bounding volumes around the triangles of a divided mesh.
#pragma once

#include "server/collision/tree/TreeStorage.h"

namespace tessera {

/// Fills corners, volumes, radius and cost from mesh, centre, unit, children and leafFaces. Volumes hold the triangles exactly
/// (rounded outwards to float).
void fitVolumes(TreeStorage& tree);

}  // namespace tessera
