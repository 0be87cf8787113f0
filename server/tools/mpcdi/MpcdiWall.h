/// A wall of an MPCDI file: a screen, a host and a tile for each region.
#pragma once

#include "server/tools/mpcdi/MpcdiFile.h"
#include "server/tools/walls/ForeignWall.h"

namespace tessera {

struct MpcdiWall : ForeignWall {
    double farthestPx = 0;  ///< of a mesh from its warp map, in pixels of the tile
};

/// Profile 2d: buffers have no metres. Each becomes a part of one plane 3.2 m wide, 2 m in front of the user's eyes,
/// its middle at their height. Profile 3d: each region's screen is the cut through its frustum 2 m in front of the
/// eyes, at (0, 1.7, 0). Profile a3: each region's screen is the plane that its pixels hit (to half a millimetre),
/// right from any place. Where they hit a bent surface it is a plane before the eyes, and right from theirs alone:
/// those are the ideal eye point at (0, 1.7, 0), or 1.7 m above the middle of the floor. Profile sl: each region has a
/// user of its own, whose eyes are the projector. Meshes have as many nodes as bring them within a tenth of a pixel of
/// their warp map at each of its pixels, at most 262144. kBadInput: a warp map with holes, or that is folded; a surface
/// that reaches behind the eyes.
[[nodiscard]] Expected<MpcdiWall> wallOfMpcdi(const MpcdiFile& file);
[[nodiscard]] Expected<ForeignWall> wallOfMpcdiFile(const std::string& path);

}  // namespace tessera
