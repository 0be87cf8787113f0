#include "client/render/cull/DepthPyramid.h"

#include <algorithm>

namespace tessera {

void DepthPyramid::build(std::span<const float> farthest, int widthPx, int heightPx) {
    levels_.assign(1, {widthPx, heightPx, 0});
    std::size_t size = farthest.size();
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        const Level& finer = levels_.back();
        levels_.push_back({(finer.width + 1) / 2, (finer.height + 1) / 2, size});
        size += static_cast<std::size_t>(levels_.back().width) * static_cast<std::size_t>(levels_.back().height);
    }
    depths_.resize(size);
    std::copy(farthest.begin(), farthest.end(), depths_.begin());
    for (std::size_t i = 1; i < levels_.size(); ++i) {
        const Level& finer = levels_[i - 1];
        const Level& level = levels_[i];
        for (int y = 0; y < level.height; ++y) {
            const float* lower = &at(finer, 0, 2 * y);
            const float* upper = &at(finer, 0, std::min(2 * y + 1, finer.height - 1));
            float* out = &at(level, 0, y);
            const int whole = finer.width / 2;
            for (int x = 0; x < whole; ++x)
                out[x] = std::min(std::min(lower[2 * x], lower[2 * x + 1]), std::min(upper[2 * x], upper[2 * x + 1]));
            if (whole < level.width) out[whole] = std::min(lower[2 * whole], upper[2 * whole]);
        }
    }
}

bool DepthPyramid::hides(const VisibilityDevice::Plate& plate) const {
    std::size_t level = 0;
    while (level + 1 < levels_.size() && (plate.right - plate.left) >> level > 4) ++level;
    while (level + 1 < levels_.size() && (plate.top - plate.bottom) >> level > 4) ++level;
    for (int y = plate.bottom >> level; y <= (plate.top - 1) >> level; ++y)
        for (int x = plate.left >> level; x <= (plate.right - 1) >> level; ++x)
            if (!hides(level, x, y, plate)) return false;
    return true;
}

bool DepthPyramid::hides(std::size_t level, int x, int y, const VisibilityDevice::Plate& plate) const {
    if (at(levels_[level], x, y) > plate.depth) return true;
    if (level == 0) return false;
    const int from = static_cast<int>(level) - 1;
    const int left = std::max(2 * x, plate.left >> from), right = std::min(2 * x + 1, (plate.right - 1) >> from);
    const int bottom = std::max(2 * y, plate.bottom >> from), top = std::min(2 * y + 1, (plate.top - 1) >> from);
    for (int j = bottom; j <= top; ++j)
        for (int i = left; i <= right; ++i)
            if (!hides(level - 1, i, j, plate)) return false;
    return true;
}

}  // namespace tessera
