/// Where the windows of a wall's outputs stand beside each other on a desktop that shows the whole wall, and which
/// tiles share one.
#pragma once

#include <string>
#include <vector>

#include "common/wall/Wall.h"

namespace tessera {

/// The tile of the other eye that goes out with this one's: both stand in one picture. Null: none. `tiles`: of the
/// host, at least.
[[nodiscard]] const Tile* partnerOf(const Tile& tile, const std::vector<Tile>& tiles);

/// Pixels from the upper left, before anything is shrunk.
struct WindowLayout {
    struct Place {
        std::string tile;  ///< the left eye's, where two share an output
        int x = 0, y = 0, width = 0, height = 0;
    };
    int width = 0, height = 0;
    std::vector<Place> places;  ///< in the order of layoutTiles; none of a right eye that goes out with the left one
};

/// Of a wall that checkWall accepts; every process of the wall comes to the same one.
///
/// The tiles of a screen meet as they do on it, bezels between them; projectors that overlap and are blended stand side
/// by side. An output of another size than its tile makes its column and row larger, and stands in the middle of its
/// cell. Screens, and the two eyes of one whose eyes have windows of their own, stand apart from each other, in the
/// wall's order, in the rows that leave most of each on a desktop of 16:9. Windows overlap by the overlap of tiles that
/// are not blended, and by nothing else. A wall of one screen and plain outputs is its screen.
[[nodiscard]] WindowLayout layoutWindows(const Wall& wall);

}  // namespace tessera
