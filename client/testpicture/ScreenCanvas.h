/// Drawing in the pixels of a whole screen, of which one tile is kept.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/image/Picture.h"

namespace tessera {

using ScreenColor = std::array<std::uint8_t, 3>;  ///< red, green, blue, sRGB

/// Coordinates: pixels of the screen's whole picture from its *upper* left corner, y down; a pixel's middle is at (x +
/// 0.5, y + 0.5). Whether a pixel belongs to a shape is worked out from its own coordinates alone, so that tiles meet
/// whatever their cut. No antialiasing: an edge is where it is.
class ScreenCanvas {
public:
    /// A part of the screen, black.
    ScreenCanvas(int leftPx, int topPx, int widthPx, int heightPx);

    /// From (x0, y0) up to, and without, (x1, y1).
    void fill(int x0, int y0, int x1, int y1, const ScreenColor& color);
    void set(int x, int y, const ScreenColor& color);
    /// Pixels whose middle is no farther than half the width from the straight line between two points.
    void line(double x0, double y0, double x1, double y1, double width, const ScreenColor& color);
    /// Pixels whose middle is no farther than half the width from a circle.
    void ring(double centerX, double centerY, double radius, double width, const ScreenColor& color);
    /// `heightPx`: of a capital; (x, y): the upper left corner of the first. Lines of a seventh of the height.
    void text(double x, double y, double heightPx, std::string_view text, const ScreenColor& color);

    [[nodiscard]] int left() const { return left_; }
    [[nodiscard]] int top() const { return top_; }
    [[nodiscard]] int right() const { return left_ + picture_.widthPx; }
    [[nodiscard]] int bottom() const { return top_ + picture_.heightPx; }
    [[nodiscard]] Picture take() && { return std::move(picture_); }

private:
    int left_, top_;
    Picture picture_;
};

}  // namespace tessera
