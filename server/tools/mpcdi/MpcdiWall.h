/// A wall of an MPCDI file: a screen, a host and a tile for each region.
#pragma once

#include "common/wall/Wall.h"
#include "server/tools/mpcdi/MpcdiFile.h"

namespace tessera {

struct MpcdiWall {
    Wall wall;
    std::vector<std::string>
        notes;              ///< what a person should know: how near meshes come to warp maps, what is not carried over
    double farthestPx = 0;  ///< of a mesh from its warp map, in pixels of the tile
};

/// Profile 2d: buffers have no metres. Each becomes a part of one plane 3.2 m wide, 2 m in front of the user's eyes,
/// its middle at their height. Profile 3d: each region's screen is the cut through its frustum 2 m in front of the
/// eyes, at (0, 1.7, 0). Meshes have as many nodes as bring them within a tenth of a pixel of their warp map at each of
/// its pixels, at most 262144. kBadInput: a warp map with holes, or that is folded.
[[nodiscard]] Expected<MpcdiWall> wallOfMpcdi(const MpcdiFile& file);

/// The wall's text for `path`, and beside it NAME-REGION.warp and NAME-REGION.png.
[[nodiscard]] Expected<void> saveMpcdiWall(const MpcdiWall& made, const std::string& path);

}  // namespace tessera
