/// Walls of SGCT (the Simple Graphics Cluster Toolkit), JSON configurations of version 1 (SGCT 3 on).
///
/// Taken from the project's own files (github.com/sgct/sgct: sgct.schema.json, config/*.json, src/config.cpp,
/// src/baseviewport.cpp, src/user.cpp, src/window.cpp). Lengths in metres, right-handed, +Y up, -Z ahead, as here.
/// A viewport's place is a part of its window, from the lower left corner. PlanarProjection: a plane `distance` (10)
/// ahead of the origin, not of the user; cut by angles (hfov, vfov, or left, right, down, up), then turned by yaw (to
/// the right), pitch (up) and roll (clockwise), in that order, then moved by `offset`. ProjectionPlane: three corners.
/// A user without a separation of eyes has 0.06 m.
#pragma once

#include <string>
#include <string_view>

#include "server/tools/walls/ForeignWall.h"

namespace tessera {

/// `path` names the file in messages.
[[nodiscard]] Expected<ForeignWall> wallOfSgct(std::string_view text, const std::string& path);

}  // namespace tessera
