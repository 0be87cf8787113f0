#include "client/render/cull/RowSpans.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// Floats are good to a hundredth of a pixel for edges up to this slope and corners up to this far away.
constexpr double kFloatSlope = 64;
constexpr double kFloatReach = 4096;
/// Beside the grid, where edges are cut off.
constexpr float kBeside = 2;

/// Truncation is floor for what is not negative, and std::floor a call where SSE2 is all there is.
int floorWithin(double value, int lowest, int highest) {
    return static_cast<int>(std::clamp<double>(value, lowest, highest) - lowest) + lowest;
}

}  // namespace

void RowSpans::find(std::span<const ScreenPoint> corners, double margin, int widthPx, int heightPx) {
    double bottom = corners[0].y;
    double top = corners[0].y;
    double reach = 0;
    for (const ScreenPoint& corner : corners) {
        bottom = std::min<double>(bottom, corner.y);
        top = std::max<double>(top, corner.y);
        reach = std::max<double>({reach, std::abs(corner.x), std::abs(corner.y)});
    }
    firstRow_ = endRow_ = 0;
    if (!(top + margin >= 0 && bottom - margin < heightPx)) return;
    firstRow_ = floorWithin(bottom - margin, 0, heightPx - 1);
    endRow_ = floorWithin(top + margin, 0, heightPx - 1) + 1;

    const auto rows = static_cast<std::size_t>(heightPx);
    if (left_.size() < rows) {
        left_.resize(rows);
        right_.resize(rows);
        from_.resize(rows);
        to_.resize(rows);
    }
    std::fill(left_.begin() + firstRow_, left_.begin() + endRow_, static_cast<float>(widthPx) + kBeside);
    std::fill(right_.begin() + firstRow_, right_.begin() + endRow_, -kBeside);
    const std::size_t edges = corners.size() == 2 ? 1 : corners.size();
    for (std::size_t i = 0; i < edges; ++i) {
        const ScreenPoint& a = corners[i];
        const ScreenPoint& b = corners[i + 1 == corners.size() ? 0 : i + 1];
        const bool upwards = a.y <= b.y;
        const double lowX = upwards ? a.x : b.x;
        const double lowY = upwards ? a.y : b.y;
        const double highX = upwards ? b.x : a.x;
        const double highY = upwards ? b.y : a.y;
        const double slope = highY > lowY ? (highX - lowX) / (highY - lowY) : 0;
        if (std::abs(slope) <= kFloatSlope && reach <= kFloatReach) {
            addEdge<float>(lowX, lowY, highX, highY, slope, margin, widthPx);
        } else {
            addEdge<double>(lowX, lowY, highX, highY, slope, margin, widthPx);
        }
    }
    constexpr int kShift = 4;
    const float up = static_cast<float>(kShift + margin);
    const float down = static_cast<float>(kShift - margin);
    for (int row = firstRow_; row < endRow_; ++row) {
        const auto r = static_cast<std::size_t>(row);
        from_[r] = std::max(0, static_cast<int>(left_[r] + down) - kShift);
        to_[r] = std::min(widthPx - 1, static_cast<int>(right_[r] + up) - kShift);
    }
}

// Row r sees the band [r - margin, r + 1 + margin]. Where an edge enters and leaves the band it is farthest to one
// side; where it ends within the band, its end is.
template <typename Real>
void RowSpans::addEdge(double lowX, double lowY, double highX, double highY, double slope, double margin, int width) {
    const int first = std::max(firstRow_, floorWithin(lowY - margin, firstRow_, endRow_));
    const int end = std::min(endRow_, floorWithin(highY + margin, firstRow_ - 1, endRow_) + 1);
    const Real lowest = static_cast<Real>(std::clamp<double>(std::min(lowX, highX), -kBeside, width + kBeside));
    const Real highest = static_cast<Real>(std::clamp<double>(std::max(lowX, highX), -kBeside, width + kBeside));
    const Real x = static_cast<Real>(lowX);
    const Real y = static_cast<Real>(lowY);
    const Real steep = static_cast<Real>(slope);
    const Real below = static_cast<Real>(-margin);
    const Real above = static_cast<Real>(1 + margin);
    const Real toLeft = slope >= 0 ? below : above;
    const Real toRight = slope >= 0 ? above : below;
    const bool level = !(highY > lowY);
    for (int row = first; row < end; ++row) {
        const Real at = static_cast<Real>(row) - y;
        const Real l = level ? lowest : x + (at + toLeft) * steep;
        const Real r = level ? highest : x + (at + toRight) * steep;
        const auto inLeft = static_cast<float>(l < lowest ? lowest : l > highest ? highest : l);
        const auto inRight = static_cast<float>(r < lowest ? lowest : r > highest ? highest : r);
        float& left = left_[static_cast<std::size_t>(row)];
        float& right = right_[static_cast<std::size_t>(row)];
        left = inLeft < left ? inLeft : left;
        right = inRight > right ? inRight : right;
    }
}

}  // namespace tessera
