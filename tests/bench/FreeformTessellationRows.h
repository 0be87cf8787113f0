/// Rows of `bench_freeform`: what the picture's points cost in a frame beside OpenSubdiv's CPU evaluation of the same
/// points.
#pragma once

#include <string>

#include "common/freeform/subdivision/ControlMesh.h"
#include "tests/bench/CollisionTable.h"

namespace tessera {

/// Without OpenSubdiv no rows. Meshes without creases, corners and holes.
void addTessellationRows(const std::string& name, const ControlMesh& mesh, int passes, CollisionTable& table);

}  // namespace tessera
