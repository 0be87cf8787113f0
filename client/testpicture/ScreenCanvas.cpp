#include "client/testpicture/ScreenCanvas.h"

#include <algorithm>
#include <cmath>

#include "client/testpicture/StrokeFont.h"

namespace tessera {

namespace {

/// The pixels whose middles lie between two coordinates, kept to a range that pictures have.
int firstPixel(double from, int atLeast) {
    return static_cast<int>(std::clamp(std::floor(from - 0.5), static_cast<double>(atLeast), 1e9));
}
int endPixel(double to, int atMost) {
    return static_cast<int>(std::clamp(std::ceil(to + 0.5), -1e9, static_cast<double>(atMost)));
}

double squaredDistance(double x, double y, double x0, double y0, double x1, double y1) {
    const double dx = x1 - x0, dy = y1 - y0, length = dx * dx + dy * dy;
    const double along = length > 0 ? std::clamp(((x - x0) * dx + (y - y0) * dy) / length, 0.0, 1.0) : 0;
    const double ox = x - (x0 + along * dx), oy = y - (y0 + along * dy);
    return ox * ox + oy * oy;
}

}  // namespace

ScreenCanvas::ScreenCanvas(int leftPx, int topPx, int widthPx, int heightPx)
    : left_(leftPx), top_(topPx), picture_(Picture::filled(widthPx, heightPx, 0, 0, 0)) {}

void ScreenCanvas::set(int x, int y, const ScreenColor& color) {
    if (x < left() || y < top() || x >= right() || y >= bottom()) return;
    const std::size_t at = 3 * (static_cast<std::size_t>(y - top_) * static_cast<std::size_t>(picture_.widthPx) +
                                static_cast<std::size_t>(x - left_));
    std::copy(color.begin(), color.end(), picture_.rgb.begin() + static_cast<std::ptrdiff_t>(at));
}

void ScreenCanvas::fill(int x0, int y0, int x1, int y1, const ScreenColor& color) {
    x0 = std::max(x0, left());
    y0 = std::max(y0, top());
    x1 = std::min(x1, right());
    y1 = std::min(y1, bottom());
    if (x0 >= x1 || y0 >= y1) return;
    for (int x = x0; x < x1; ++x) set(x, y0, color);
    const auto row = [&](int y) {
        return picture_.rgb.begin() + 3 * (std::ptrdiff_t{y - top_} * picture_.widthPx + (x0 - left_));
    };
    for (int y = y0 + 1; y < y1; ++y) std::copy_n(row(y0), 3 * (x1 - x0), row(y));
}

void ScreenCanvas::line(double x0, double y0, double x1, double y1, double width, const ScreenColor& color) {
    const double half = 0.5 * width, reach = half * half;
    const double dx = x1 - x0, dy = y1 - y0;
    const bool steep = std::abs(dy) >= std::abs(dx);
    // Along the longer axis, and across it as far as the line can be wide there, its round ends included. That only
    // saves time: each pixel is judged by itself.
    const double across = 1.5 * width + 2;
    if (steep) {
        for (int y = firstPixel(std::min(y0, y1) - half, top()); y < endPixel(std::max(y0, y1) + half, bottom()); ++y) {
            const double middle = dy != 0 ? x0 + (y + 0.5 - y0) * dx / dy : x0;
            for (int x = firstPixel(middle - across, left()); x < endPixel(middle + across, right()); ++x)
                if (squaredDistance(x + 0.5, y + 0.5, x0, y0, x1, y1) <= reach) set(x, y, color);
        }
    } else {
        for (int x = firstPixel(std::min(x0, x1) - half, left()); x < endPixel(std::max(x0, x1) + half, right()); ++x) {
            const double middle = y0 + (x + 0.5 - x0) * dy / dx;
            for (int y = firstPixel(middle - across, top()); y < endPixel(middle + across, bottom()); ++y)
                if (squaredDistance(x + 0.5, y + 0.5, x0, y0, x1, y1) <= reach) set(x, y, color);
        }
    }
}

void ScreenCanvas::ring(double centerX, double centerY, double radius, double width, const ScreenColor& color) {
    const double outer = radius + 0.5 * width, inner = std::max(0.0, radius - 0.5 * width);
    for (int y = firstPixel(centerY - outer, top()); y < endPixel(centerY + outer, bottom()); ++y) {
        const double dy = y + 0.5 - centerY;
        const double far = std::sqrt(std::max(0.0, outer * outer - dy * dy)),
                     near = std::sqrt(std::max(0.0, inner * inner - dy * dy));
        const auto arc = [&](double from, double to) {
            for (int x = firstPixel(from - 1, left()); x < endPixel(to + 1, right()); ++x) {
                const double ox = x + 0.5 - centerX, squared = ox * ox + dy * dy;
                if (squared <= outer * outer && squared >= inner * inner) set(x, y, color);
            }
        };
        arc(centerX - far, centerX - near);
        arc(centerX + near, centerX + far);
    }
}

void ScreenCanvas::text(double x, double y, double heightPx, std::string_view text, const ScreenColor& color) {
    for (const Stroke& s : strokesOf(text)) {
        // A dot of less than that can fall between the middles of four pixels.
        const bool dot = s.x0 == s.x1 && s.y0 == s.y1;
        line(x + heightPx * s.x0, y + heightPx * s.y0, x + heightPx * s.x1, y + heightPx * s.y1,
             std::max(dot ? 1.5 : 1.0, heightPx / 7), color);
    }
}

}  // namespace tessera
