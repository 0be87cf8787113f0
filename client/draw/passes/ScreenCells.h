/// The cells that the picture of a screen is made of.
#pragma once

#include <vector>

#include "common/wall/View.h"

namespace tessera {

/// A screen's picture is cut at multiples of these, from its lower left corner, on every wall and whatever the tiles
/// are; each cell is drawn in coordinates of its own. So all who draw a pixel compute the same, buffers never reach
/// farther than a cell, however large the screen is. Both are multiples of the grid of 64 pixels on which scissors lie.
inline constexpr int kCellWidthPx = 1024, kCellHeightPx = 576;

/// What a rectangle of a screen shares with one cell.
struct CellPart {
    ScreenCamera camera;  ///< of the whole cell, also where it reaches beyond the screen
    PixelRect onScreen;   ///< in the screen's pixels
    PixelRect inCell;     ///< the same in the cell's
};

/// Row by row from below. The rectangle lies on the screen.
[[nodiscard]] std::vector<CellPart> cellsOf(const ScreenCamera& camera, const PixelRect& rect);

}  // namespace tessera
