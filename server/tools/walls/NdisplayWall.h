/// Walls of Unreal's nDisplay: .ndisplay files, JSON (4.27 and 5).
///
/// Taken from files of those who use it (github.com/VRGroupRWTH/rwth-vr-toolkit, Content/RWTHVRCluster/Config), from
/// the reference of the format in Unreal's documentation, and from how its "simple" policy sees a screen. Lengths in
/// centimetres, left-handed: X ahead, Y right, Z up. Rotations in degrees: roll, pitch (up), then yaw (to the right).
/// Places are those in their parent, which is an xform, or nothing. A screen of `size` lies around its place, its
/// picture seen along +X. Cameras are heads, their eyes `interpupillaryDistance` apart along their Y.
#pragma once

#include <string>
#include <string_view>

#include "server/tools/walls/ForeignWall.h"

namespace tessera {

/// `path` names the file in messages.
[[nodiscard]] Expected<ForeignWall> wallOfNdisplay(std::string_view text, const std::string& path);

}  // namespace tessera
