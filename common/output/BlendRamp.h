/// Light where tiles of a screen overlap: ramps that add up to one, and black that is as bright everywhere.
#pragma once

#include <array>

#include "common/wall/Wall.h"

namespace tessera {

/// Pixels of a tile that neighbours show too, at each of its edges.
struct TileOverlaps {
    int widthPx = 0, heightPx = 0;  ///< of the tile
    int left = 0, right = 0, top = 0, bottom = 0;

    /// Of which of nine parts a place is: 3 · (0 upper, 1 middle, 2 lower) + (0 left, 1 middle, 2 right). In pixels
    /// from the upper left corner; a pixel's centre lies at half ones.
    [[nodiscard]] int partAt(double x, double y) const;
    /// The share of light that this tile gives there: t²(3 - 2t) across an overlap, whose mirror image adds up with it
    /// to 1; at corners products, four of which do.
    [[nodiscard]] double shareAt(double x, double y) const;
};
[[nodiscard]] TileOverlaps overlapsOf(const Screen& screen, int column, int row);

/// The light of projectors' black, as parts of white's, over a tile's nine parts: what has to be added so that the
/// screen is as bright as where most of them overlap.
struct BlackLift {
    std::array<double, 9> added{};  ///< to the light of each part
    double most = 0;                ///< of the whole screen: the largest of these
    double largestBlack = 0;        ///< of the whole screen's projectors
};
/// Of one eye's tiles of a screen.
[[nodiscard]] BlackLift blackLiftOf(const Wall& wall, const Tile& tile);

}  // namespace tessera
