#include "client/draw/passes/ScreenBlocks.h"

#include <algorithm>

#include "client/draw/passes/BlockRows.h"

namespace tessera {
ScreenBlocks::ScreenBlocks(const PixelRect& within) {
    const std::uint16_t columns =
        blockColumns<std::uint16_t>(within.x / kSidePx, (within.x + within.width - 1) / kSidePx);
    for (int row = within.y / kSidePx; row * kSidePx < within.y + within.height; ++row)
        all_[static_cast<std::size_t>(row)] = columns;
}

void ScreenBlocks::add(const places::Rectangle& found, int cellX, int cellY) {
    // Not a number is anywhere.
    if (!(found.lowerX <= found.upperX && found.lowerY <= found.upperY)) return addAll();
    // Rounded down: what is cast is no less than 0.
    const auto block = [](double px, int count) {
        return static_cast<int>(std::clamp(px / kSidePx, -1.0, static_cast<double>(count)) + 1) - 1;
    };
    const int left = std::max(block(found.lowerX - cellX, kColumns), 0),
              right = std::min(block(found.upperX - cellX, kColumns), kColumns - 1);
    const int below = std::max(block(found.lowerY - cellY, kRows), 0),
              above = std::min(block(found.upperY - cellY, kRows), kRows - 1);
    if (left > right) return;
    const std::uint16_t columns = blockColumns<std::uint16_t>(left, right);
    for (int row = below; row <= above; ++row) {
        const auto r = static_cast<std::size_t>(row);
        rows_[r] = static_cast<std::uint16_t>(rows_[r] | (columns & all_[r]));
    }
}

void ScreenBlocks::add(const ScreenBlocks& other) {
    for (std::size_t r = 0; r < rows_.size(); ++r)
        rows_[r] = static_cast<std::uint16_t>(rows_[r] | (other.rows_[r] & all_[r]));
}

std::vector<PixelRect> ScreenBlocks::rectangles(const PixelRect& pixels) const {
    std::vector<PixelRect> found;
    for (const PixelRect& all : blockRectangles(rows_, kSidePx)) {
        PixelRect r{.x = std::max(all.x, pixels.x), .y = std::max(all.y, pixels.y), .width = 0, .height = 0};
        r.width = std::min(all.x + all.width, pixels.x + pixels.width) - r.x;
        r.height = std::min(all.y + all.height, pixels.y + pixels.height) - r.y;
        if (r.width > 0 && r.height > 0) found.push_back(r);
    }
    return found;
}

}  // namespace tessera
