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

    /// A rectangle of whole blocks, in pixels.
    struct Region {
        int x = 0, y = 0, width = 0, height = 0;
        [[nodiscard]] bool empty() const { return width <= 0 || height <= 0; }
    };

    /// Forgets everything.
    void reset(int widthPx, int heightPx);
    /// The blocks that meet [lowerX, upperX] × [lowerY, upperY], as far as the tile has them.
    [[nodiscard]] Region blocksAround(double lowerX, double lowerY, double upperX, double upperY) const;
    /// Takes over what hides more than is known. `values`: a row after the other from the bottom; infinite where the
    /// surface is not, 0 where it hides nothing.
    void merge(const Region& region, std::span<const float> values);
    /// Whether nothing of the footprint can be seen. True also for a footprint beside the tile.
    [[nodiscard]] bool hides(const Footprint& footprint) const;

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
