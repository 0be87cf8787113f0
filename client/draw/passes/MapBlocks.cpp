#include "client/draw/passes/MapBlocks.h"

#include <algorithm>

#include "client/draw/passes/BlockRows.h"

namespace tessera {
namespace {

struct BlockRange {
    int left = 0, right = 0, below = 0, above = 0;  ///< the last ones included
    std::uint32_t columns = 0;
};
BlockRange rangeOf(const PixelRect& rect) {
    const auto block = [](int px) { return std::clamp(px / MapBlocks::kSidePx, 0, MapBlocks::kCount - 1); };
    BlockRange range{.left = block(rect.x),
                     .right = block(rect.x + rect.width - 1),
                     .below = block(rect.y),
                     .above = block(rect.y + rect.height - 1)};
    range.columns = blockColumns<std::uint32_t>(range.left, range.right);
    return range;
}

}  // namespace

void MapBlocks::add(const PixelRect& rect) {
    if (rect.width <= 0 || rect.height <= 0) return;
    const BlockRange range = rangeOf(rect);
    for (int row = range.below; row <= range.above; ++row) rows_[static_cast<std::size_t>(row)] |= range.columns;
}

void MapBlocks::add(const MapBlocks& other) {
    for (std::size_t row = 0; row < rows_.size(); ++row) rows_[row] |= other.rows_[row];
}

bool MapBlocks::empty() const {
    return std::ranges::all_of(rows_, [](std::uint32_t row) { return row == 0; });
}

bool MapBlocks::meets(const PixelRect& rect) const {
    if (rect.width <= 0 || rect.height <= 0) return false;
    const BlockRange range = rangeOf(rect);
    for (int row = range.below; row <= range.above; ++row)
        if (rows_[static_cast<std::size_t>(row)] & range.columns) return true;
    return false;
}

PixelRect MapBlocks::around() const {
    std::uint32_t columns = 0;
    int below = kCount, above = -1;
    for (int row = 0; row < kCount; ++row) {
        if (rows_[static_cast<std::size_t>(row)] == 0) continue;
        columns |= rows_[static_cast<std::size_t>(row)];
        below = std::min(below, row);
        above = row;
    }
    if (columns == 0) return {};
    const int left = std::countr_zero(columns), right = 31 - std::countl_zero(columns);
    return {.x = left * kSidePx,
            .y = below * kSidePx,
            .width = (right + 1 - left) * kSidePx,
            .height = (above + 1 - below) * kSidePx};
}

std::vector<PixelRect> MapBlocks::rectangles() const {
    return blockRectangles(rows_, kSidePx);
}

}  // namespace tessera
