#include "client/render/cull/RowSpans.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace tessera {
namespace {

using Point = std::pair<double, double>;

/// Whether the convex polygon and the square meet, by clipping one against the other (Sutherland and Hodgman 1974).
bool meets(const std::vector<ScreenPoint>& corners, double left, double bottom, double right, double top) {
    std::vector<Point> polygon;
    for (const ScreenPoint& c : corners) polygon.emplace_back(c.x, c.y);
    const auto clip = [&polygon](auto inside) {
        std::vector<Point> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Point& a = polygon[i];
            const Point& b = polygon[(i + 1) % polygon.size()];
            const double da = inside(a);
            const double db = inside(b);
            if (da >= 0) kept.push_back(a);
            if ((da >= 0) != (db >= 0)) {
                const double t = da / (da - db);
                kept.emplace_back(a.first + t * (b.first - a.first), a.second + t * (b.second - a.second));
            }
        }
        polygon = kept;
    };
    clip([&](const Point& p) { return p.first - left; });
    clip([&](const Point& p) { return right - p.first; });
    clip([&](const Point& p) { return p.second - bottom; });
    clip([&](const Point& p) { return top - p.second; });
    return !polygon.empty();
}

// The culler's proof stands on this: what is marked meets the grown square, what meets it is marked.
TEST(RowSpans, FindThePixelsWhoseGrownSquaresMeetThePolygonAndNoOthers) {
    std::mt19937 random(3);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    constexpr int kWidth = 40;
    constexpr int kHeight = 32;
    RowSpans spans;
    int polygons = 0;
    for (int round = 0; round < 6000; ++round) {
        const double size = std::pow(10.0, uniform(-2.5, round % 10 == 0 ? 5.0 : 2.0));
        const double x = uniform(-6, 46);
        const double y = uniform(-4, 36);
        std::vector<ScreenPoint> corners(2 + random() % 2);
        for (ScreenPoint& corner : corners) {
            corner.x = static_cast<float>(x + size * uniform(-1, 1));
            corner.y = static_cast<float>(y + (round % 4 == 0 ? 1e-3 : 1.0) * size * uniform(-1, 1));
        }
        if (round % 7 == 0) corners[1].y = corners[0].y;
        if (round % 11 == 0) corners[1].x = corners[0].x;
        const double margin = uniform(0.2, 0.5);
        spans.find(corners, margin, kWidth, kHeight);
        // Pixels for which a hundredth of a pixel decides may go either way.
        for (int row = 0; row < kHeight; ++row) {
            const bool any = row >= spans.firstRow() && row < spans.endRow();
            for (int column = 0; column < kWidth; ++column) {
                const bool found = any && spans.from(row) <= column && column <= spans.to(row);
                const double px = column;
                const double py = row;
                const double grown = margin + (found ? 0.01 : -0.01);
                const bool expected = meets(corners, px - grown, py - grown, px + 1 + grown, py + 1 + grown);
                ASSERT_EQ(found, expected) << "round " << round << " pixel " << column << "," << row;
            }
        }
        polygons += spans.endRow() > spans.firstRow();
    }
    EXPECT_GT(polygons, 3000);
}

}  // namespace
}  // namespace tessera
