#include "client/draw/passes/ScreenBlocks.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tessera {
namespace {

/// Bits [first, last].
std::uint16_t columnsOf(int first, int last) {
    return static_cast<std::uint16_t>((2u << last) - (1u << first));
}

}  // namespace

ScreenBlocks::ScreenBlocks(const PixelRect& within) {
    const std::uint16_t columns = columnsOf(within.x / kSidePx, (within.x + within.width - 1) / kSidePx);
    for (int row = within.y / kSidePx; row * kSidePx < within.y + within.height; ++row)
        all_[static_cast<std::size_t>(row)] = columns;
}

void ScreenBlocks::add(Footprint footprint, double reachPx) {
    footprint.grow(reachPx);
    // Not a number is anywhere, too.
    const bool known = footprint.lowerX <= footprint.upperX && footprint.lowerY <= footprint.upperY;
    if (footprint.nearPlane || !known) return addAll();
    const auto block = [](double px, int count) {
        return static_cast<int>(std::floor(std::clamp(px / kSidePx, -1.0, static_cast<double>(count))));
    };
    const int left = std::max(block(footprint.lowerX, kColumns), 0),
              right = std::min(block(footprint.upperX, kColumns), kColumns - 1);
    const int below = std::max(block(footprint.lowerY, kRows), 0),
              above = std::min(block(footprint.upperY, kRows), kRows - 1);
    if (left > right) return;
    const std::uint16_t columns = columnsOf(left, right);
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
    Rows left = rows_;
    for (int row = 0; row < kRows; ++row) {
        while (std::uint16_t& here = left[static_cast<std::size_t>(row)]) {
            // The first run of this row, and as many rows above it as have all of it.
            const int first = std::countr_zero(here);
            const int last = first + std::countr_one(static_cast<std::uint16_t>(here >> first)) - 1;
            const std::uint16_t run = columnsOf(first, last);
            int end = row;
            for (; end < kRows && (left[static_cast<std::size_t>(end)] & run) == run; ++end) {
                std::uint16_t& taken = left[static_cast<std::size_t>(end)];
                taken = static_cast<std::uint16_t>(taken & ~run);
            }
            PixelRect r{.x = std::max(first * kSidePx, pixels.x),
                        .y = std::max(row * kSidePx, pixels.y),
                        .width = 0,
                        .height = 0};
            r.width = std::min((last + 1) * kSidePx, pixels.x + pixels.width) - r.x;
            r.height = std::min(end * kSidePx, pixels.y + pixels.height) - r.y;
            if (r.width > 0 && r.height > 0) found.push_back(r);
        }
    }
    return found;
}

}  // namespace tessera
