/// For each pixel of a tile: up to which depth everything is hidden. Over blocks of 8 × 8 pixels the weakest of them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "client/render/TileProjection.h"

namespace tessera {

/// Values are inverse depths (see TileProjection): what is farther than its pixel's value is hidden there. 0: nothing
/// is.
class OcclusionBuffer {
public:
    static constexpr int kBlock = 8;

    /// Forgets everything.
    void reset(int widthPx, int heightPx);
    /// Of a row of pixels, and of rows, in whole blocks: what `values` below counts.
    [[nodiscard]] int stridePx() const { return stride_; }
    [[nodiscard]] int rows() const { return rows_; }
    /// Takes over what hides more than is known, for the blocks [fromBlock, toBlock] of one row of blocks. `values`
    /// holds the whole tile: infinite where the surface is not, 0 where it hides nothing. Those taken are left
    /// infinite.
    void merge(int blockRow, int fromBlock, int toBlock, std::span<float> values);
    /// Whether nothing of the footprint can be seen. True also for a footprint beside the tile.
    [[nodiscard]] bool hides(const Footprint& footprint) const;

    /// The weakest pixel of each block of a row of blocks.
    [[nodiscard]] std::span<const float> blocksOf(int blockRow) const {
        const auto columns = static_cast<std::size_t>(stride_ / kBlock);
        return std::span(blocks_).subspan(static_cast<std::size_t>(blockRow) * columns, columns);
    }
    [[nodiscard]] float at(int x, int y) const { return pixels_[index(x, y)]; }
    [[nodiscard]] int widthPx() const { return width_; }
    [[nodiscard]] int heightPx() const { return height_; }

private:
    [[nodiscard]] std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(x);
    }

    int width_ = 0, height_ = 0;
    int stride_ = 0, rows_ = 0;  ///< rounded up to whole blocks
    std::vector<float> pixels_;
    std::vector<float> blocks_;
};

}  // namespace tessera
