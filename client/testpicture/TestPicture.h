/// The picture that a wall is set up by: drawn by each host's processor, in the exact pixels of its screens.
#pragma once

#include <cstdint>
#include <optional>

#include "common/image/Picture.h"
#include "common/wall/Wall.h"

namespace tessera {

struct TestPictureOptions {
    bool marks = true;  ///< of the tile: its name, host, eye, border, what it shares or what is hidden beside it
    std::optional<std::uint64_t> frame;  ///< with marks: this number too
};

/// What the tile shows. Without marks it is a cut out of one picture of the whole screen, in which neither columns nor
/// eyes matter: grid (a line of one pixel every 64, numbers every 256, from the lower left), circles and diagonals over
/// the whole screen, its border, arrows up and right, ramps of grey, red, green and blue, patches near black and white.
[[nodiscard]] Picture testPicture(const Wall& wall, const Tile& tile, const TestPictureOptions& options = {});

}  // namespace tessera
