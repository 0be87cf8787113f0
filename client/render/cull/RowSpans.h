/// Which pixels of a grid a line or a convex polygon meets, row by row.
#pragma once

#include <span>
#include <vector>

namespace tessera {

/// A vertex on a tile: pixels and inverse depth.
struct ScreenPoint {
    float x = 0, y = 0, depth = 0;
};

/// Holds the answer for one polygon at a time; the memory stays.
class RowSpans {
public:
    /// The pixels whose squares, grown by `margin` on each side, meet the polygon of two to four corners: no others,
    /// and, up to a hundredth of a pixel, all of them. What a convex set has in a band of rows is an interval, hence
    /// spans.
    void find(std::span<const ScreenPoint> corners, double margin, int widthPx, int heightPx);

    /// Rows [firstRow, endRow) and pixels [from, to] within them count from the region's lower left. A row may be
    /// empty: from > to.
    [[nodiscard]] int firstRow() const { return firstRow_; }
    [[nodiscard]] int endRow() const { return endRow_; }
    [[nodiscard]] int from(int row) const { return from_[static_cast<std::size_t>(row)]; }
    [[nodiscard]] int to(int row) const { return to_[static_cast<std::size_t>(row)]; }

private:
    template <typename Real>
    void addEdge(double lowX, double lowY, double highX, double highY, double slope, double margin, int width);

    int firstRow_ = 0, endRow_ = 0;
    std::vector<float> left_, right_;  ///< by row, in pixels
    std::vector<int> from_, to_;
};

}  // namespace tessera
