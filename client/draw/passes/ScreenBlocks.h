/// Where in a cell anything can be seen, in blocks. No GL.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/draw/passes/ScreenCells.h"
#include "client/render/TileProjection.h"

namespace tessera {

/// Blocks of 64×64 pixels of a cell: those that something may touch. What lies in no block is surely nothing but
/// background. Blocks lie on the grid that scissors lie on, and are the same on every tile but for those that it does
/// not have.
class ScreenBlocks {
public:
    static constexpr int kSidePx = 64, kColumns = kCellWidthPx / kSidePx, kRows = kCellHeightPx / kSidePx;

    ScreenBlocks() = default;
    /// None, of those that this rectangle of the cell's pixels shares in.
    explicit ScreenBlocks(const PixelRect& within);

    /// What may be drawn there, in pixels of a screen on which the cell's lower left corner lies there. Anywhere where
    /// that is not known.
    void add(const places::Rectangle& found, int cellX, int cellY);
    void addAll() { rows_ = all_; }
    void add(const ScreenBlocks& other);
    [[nodiscard]] bool full() const { return rows_ == all_; }
    /// What these blocks have of `pixels`: rectangles that lie apart, few and large.
    [[nodiscard]] std::vector<PixelRect> rectangles(const PixelRect& pixels) const;

private:
    using Rows = std::array<std::uint16_t, kRows>;  ///< bit: column
    static_assert(kColumns == 16);

    Rows all_{}, rows_{};
};

}  // namespace tessera
