/// The farthest depth of ever larger squares of pixels (hierarchical Z; Greene, Kass, Miller 1993).
#pragma once

#include <span>
#include <vector>

#include "client/render/cull/VisibilityDevice.h"

namespace tessera {

class DepthPyramid {
public:
    /// Of a part of this size: per pixel the farthest of its samples' depths, rows from below.
    void build(std::span<const float> farthest, int widthPx, int heightPx);
    /// Whether every sample under the plate has a depth strictly nearer than it. Exact: begins where few squares lie
    /// under the plate, and looks closer where a square does not decide.
    [[nodiscard]] bool hides(const VisibilityDevice::Plate& plate) const;

private:
    struct Level {
        int width, height;
        std::size_t first;  ///< of `depths_`
    };
    [[nodiscard]] bool hides(std::size_t level, int x, int y, const VisibilityDevice::Plate& plate) const;
    [[nodiscard]] float& at(const Level& level, int x, int y) {
        return depths_[level.first + static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) +
                       static_cast<std::size_t>(x)];
    }
    [[nodiscard]] float at(const Level& level, int x, int y) const {
        return const_cast<DepthPyramid*>(this)->at(level, x, y);
    }

    std::vector<Level> levels_;
    std::vector<float> depths_;
};

}  // namespace tessera
