/// Where each pixel of an output looks through a warp mesh.
#pragma once

#include <functional>

#include "common/wall/Output.h"

namespace tessera {

/// What a pixel of an output shows: a place in the tile's picture (0 to 1 from its left and its *upper* edge; beyond:
/// nothing), and how much of its light.
struct Look {
    double u = 0, v = 0, intensity = 1;
};

/// Calls `see(x, y, look)` for each pixel of an output (rows from the top) whose centre lies in a face of the mesh, at
/// least once: on an edge perhaps for both faces, with the same place. Places are bilinear in each face. The mesh has
/// passed `findWarpFault`.
void lookThrough(const WarpMesh& mesh, int widthPx, int heightPx,
                 const std::function<void(int x, int y, const Look&)>& see);

}  // namespace tessera
