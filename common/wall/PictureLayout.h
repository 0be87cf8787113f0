/// Where tiles' images go in one picture of the whole wall.
#pragma once

#include <string>
#include <vector>

#include "common/wall/Wall.h"

namespace tessera {

enum class PictureKind {
    kMosaic,      ///< the visible pixels without gaps
    kWithBezels,  ///< as a visitor sees it: hidden pixels take their room
};

/// A picture counts from the *upper* left, as image files do. Several screens stand side by side in the wall's order,
/// their lower edges in line.
struct PictureLayout {
    struct Place {
        std::string tile;
        int xPx = 0, yPx = 0;  ///< of the image's upper left corner
        int widthPx = 0, heightPx = 0;
    };
    int widthPx = 0, heightPx = 0;
    std::vector<Place> places;  ///< in the order of layoutTiles
};

/// What one eye sees: tiles for both eyes together and those for `eye`. kCenter: the left eye's, where a cell has two.
[[nodiscard]] PictureLayout layoutPicture(const Wall& wall, PictureKind kind, Eye eye = Eye::kCenter);

/// Whether any tile is for one eye only.
[[nodiscard]] bool isStereo(const Wall& wall);

/// "1920x1080".
[[nodiscard]] Expected<ScreenPixels> parsePixels(std::string_view text);

}  // namespace tessera
