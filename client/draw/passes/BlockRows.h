/// Blocks of a grid, a word for each row and a bit for each column. No GL.
#pragma once

#include <array>
#include <bit>
#include <vector>

#include "common/wall/View.h"

namespace tessera {

/// Bits [first, last].
template <typename Row>
[[nodiscard]] constexpr Row blockColumns(int first, int last) {
    return static_cast<Row>((2u << last) - (1u << first));
}

/// What is set, in pixels of blocks of this side: rectangles that lie apart, few and large.
template <typename Row, std::size_t kRows>
[[nodiscard]] std::vector<PixelRect> blockRectangles(std::array<Row, kRows> left, int sidePx) {
    std::vector<PixelRect> found;
    for (std::size_t row = 0; row < kRows; ++row) {
        while (const Row here = left[row]) {
            // The first run of this row, and as many rows above it as have all of it.
            const int first = std::countr_zero(here);
            const int last = first + std::countr_one(static_cast<Row>(here >> first)) - 1;
            const auto run = blockColumns<Row>(first, last);
            std::size_t end = row;
            for (; end < kRows && (left[end] & run) == run; ++end) left[end] = static_cast<Row>(left[end] & ~run);
            found.push_back({.x = first * sidePx,
                             .y = static_cast<int>(row) * sidePx,
                             .width = (last + 1 - first) * sidePx,
                             .height = static_cast<int>(end - row) * sidePx});
        }
    }
    return found;
}

}  // namespace tessera
