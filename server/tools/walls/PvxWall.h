/// Walls of ParaView's servers: .pvx files.
///
/// Taken from the project's own files (github.com/Kitware/ParaView: Remoting/Core/vtkDisplayConfiguration.cxx,
/// Clients/ParaView/Testing/XML/*.pvx). Elements `Machine`, straight in `pvx` or in a `Process` (of type "server" where
/// there are several), each a rank's display: three corners, right-handed, +Y up, -Z ahead, in the unit of the room,
/// which is taken as metres. The eyes are at the origin, looking along -Z, `EyeSeparation` apart (0.065 m); of
/// several viewers each has a `ViewerId`. `Geometry` is WIDTHxHEIGHT+X+Y in pixels.
#pragma once

#include <string>
#include <string_view>

#include "server/tools/walls/ForeignWall.h"

namespace tessera {

/// `path` names the file in messages.
[[nodiscard]] Expected<ForeignWall> wallOfPvx(std::string_view text, const std::string& path);

}  // namespace tessera
