/// Rectangles on planes that belong together, as screens with grids. Inside of this folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/wall/Wall.h"

namespace tessera {

/// One display's picture: where it is, and its pixels.
struct DisplayPanel {
    std::string name, user;                                                        ///< whose head it is drawn for
    Vec3d lowerLeft = Vec3d::Zero(), right = Vec3d::UnitX(), up = Vec3d::UnitY();  ///< a corner and the edges from it
    int widthPx = 0, heightPx = 0;
};
[[nodiscard]] bool samePlace(const DisplayPanel& a, const DisplayPanel& b);

/// Panels that are one screen: its geometry without a name, and each one's column and row.
struct DisplayGrid {
    Screen screen;
    struct Cell {
        std::size_t panel = 0;  ///< index
        int column = 0, row = 0;
    };
    std::vector<Cell> cells;
    std::string why;  ///< of a single panel that others lie beside: why it is not in a grid with them; else empty
};
/// All panels, each in one grid, in the order of the first of each.
[[nodiscard]] std::vector<DisplayGrid> joinPanels(const std::vector<DisplayPanel>& panels);

}  // namespace tessera
