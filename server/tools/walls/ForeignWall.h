/// A wall that was made of somebody else's description of one.
#pragma once

#include <numbers>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/wall/Wall.h"

namespace tessera {

struct ForeignWall {
    Wall wall;
    std::vector<std::string> notes;  ///< what a person should know: what is not carried over, what was guessed
    std::string source;              ///< "SGCT"; for the file's first line
};

/// `text` as walls, folders and logs may name a thing, at most 40 bytes, with a number behind it where it is `taken`.
[[nodiscard]] std::string wallName(std::string_view text, std::set<std::string>& taken);

[[nodiscard]] inline double radiansOf(double degrees) {
    return degrees * std::numbers::pi / 180;
}

/// A rectangle of a plane, by its lower left corner and its edges.
[[nodiscard]] Screen screenOf(const std::string& name, const Vec3d& corner, const Vec3d& right, const Vec3d& up);

/// The wall's text for `path`, with the notes as comments. Where outputs have meshes and pictures, those too beside it:
/// each is named like the wall, with the output's own name behind it.
[[nodiscard]] Expected<void> saveForeignWall(const ForeignWall& made, const std::string& path);

}  // namespace tessera
