#include "client/render/cull/OcclusionBuffer.h"

#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// Depths that differ by less are not told apart.
constexpr float kDepthMargin = 1.001f;

int roundUp(int value) {
    return (value + OcclusionBuffer::kBlock - 1) / OcclusionBuffer::kBlock * OcclusionBuffer::kBlock;
}

/// floor as an int within [lowest, highest], whatever the value.
int pixelAt(double value, int lowest, int highest) {
    return static_cast<int>(std::clamp<double>(value, lowest, highest) - lowest) + lowest;
}

}  // namespace

void OcclusionBuffer::reset(int widthPx, int heightPx) {
    width_ = widthPx;
    height_ = heightPx;
    stride_ = roundUp(widthPx);
    rows_ = roundUp(heightPx);
    pixels_.assign(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows_), 0.0f);
    blocks_.assign(pixels_.size() / (kBlock * kBlock), 0.0f);
}

void OcclusionBuffer::merge(int blockRow, int fromBlock, int toBlock, std::span<float> values) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (int block = fromBlock; block <= toBlock; ++block) {
        const std::size_t corner = index(block * kBlock, blockRow * kBlock);
        float* pixel = &pixels_[corner];
        float* value = &values[corner];
        float least[kBlock];
        std::fill(least, least + kBlock, kInfinity);
        for (int y = 0; y < kBlock; ++y, pixel += stride_, value += stride_) {
            for (int x = 0; x < kBlock; ++x) {
                const float added = value[x] < kInfinity ? value[x] : 0.0f;
                const float merged = pixel[x] < added ? added : pixel[x];
                pixel[x] = merged;
                least[x] = merged < least[x] ? merged : least[x];
                value[x] = kInfinity;
            }
        }
        blocks_[static_cast<std::size_t>(blockRow * (stride_ / kBlock) + block)] =
            *std::min_element(least, least + kBlock);
    }
}

bool OcclusionBuffer::hides(const Footprint& footprint) const {
    if (footprint.nearPlane) return false;
    if (footprint.upperX < 0 || footprint.upperY < 0 || footprint.lowerX >= width_ || footprint.lowerY >= height_)
        return true;
    const int x0 = pixelAt(footprint.lowerX, 0, width_ - 1);
    const int y0 = pixelAt(footprint.lowerY, 0, height_ - 1);
    const int x1 = pixelAt(footprint.upperX, 0, width_ - 1);
    const int y1 = pixelAt(footprint.upperY, 0, height_ - 1);
    const float needed = static_cast<float>(footprint.nearest) * kDepthMargin;
    for (int by = y0 / kBlock; by <= y1 / kBlock; ++by) {
        for (int bx = x0 / kBlock; bx <= x1 / kBlock; ++bx) {
            if (blocks_[static_cast<std::size_t>(by * (stride_ / kBlock) + bx)] > needed) continue;
            const int left = std::max(x0, bx * kBlock);
            const int right = std::min(x1, bx * kBlock + kBlock - 1);
            const int bottom = std::max(y0, by * kBlock);
            const int top = std::min(y1, by * kBlock + kBlock - 1);
            for (int y = bottom; y <= top; ++y) {
                for (int x = left; x <= right; ++x) {
                    if (!(pixels_[index(x, y)] > needed)) return false;
                }
            }
        }
    }
    return true;
}

}  // namespace tessera
