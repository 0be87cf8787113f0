/// Walls of OpenCOVER (COVISE's renderer): XML configurations, root COCONFIG.
///
/// Taken from the project's own files (github.com/hlrs-vis/covise: config/*.xml, src/OpenCOVER/cover/coVRConfig.cpp,
/// coCoverConfig.cpp, VRViewer.cpp). What holds for a computer is what GLOBAL, then CLUSTER, then LOCAL with its name
/// in HOST say below COVER; the later one counts. Lengths in millimetres, right-handed: X right, Y ahead, Z up. A
/// Screen lies around its origin, its picture seen along +Y, then turned by r about Y, p about X, h about Z. Channel i
/// shows Screen `screenIndex` (i) in Viewport `viewportIndex` (i) of a Window. ViewerPosition is (0, -2000, 30)
/// where nothing is said, the eyes 64 apart where Stereo is on.
#pragma once

#include <string>
#include <string_view>

#include "server/tools/walls/ForeignWall.h"

namespace tessera {

/// `path` names the file in messages.
[[nodiscard]] Expected<ForeignWall> wallOfCover(std::string_view text, const std::string& path);

}  // namespace tessera
