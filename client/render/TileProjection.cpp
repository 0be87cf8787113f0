#include "client/render/TileProjection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// Bit 0 of a corner's number chooses upper or lower x, bit 1 y, bit 2 z.
[[gnu::always_inline]] inline std::array<Vec4d, 8> cornersOf(const Mat4d& clip_T_box, const Box& box) {
    const Vec3d size = box.size();
    const Vec4d edge[3] = {clip_T_box.col(0) * size.x(), clip_T_box.col(1) * size.y(), clip_T_box.col(2) * size.z()};
    std::array<Vec4d, 8> corners;
    corners[0] = clip_T_box * box.lower.homogeneous();
    // Each from the corner without the lowest of its edges.
    corners[4] = corners[0] + edge[2];
    for (unsigned i = 0; i < 8; i += 4) corners[i + 2] = corners[i] + edge[1];
    for (unsigned i = 0; i < 8; i += 2) corners[i + 1] = corners[i] + edge[0];
    return corners;
}

/// A convex polygon that is cut in place: a face of a box and the planes of a tile.
struct CutPolygon {
    std::array<Vec4d, 12> corners;
    std::size_t size = 0;

    /// Keeps what has plane · corner >= 0 (Sutherland and Hodgman 1974).
    void cut(const Vec4d& plane) {
        CutPolygon kept;
        for (std::size_t i = 0; i < size; ++i) {
            const Vec4d& a = corners[i];
            const Vec4d& b = corners[i + 1 == size ? 0 : i + 1];
            const double da = plane.dot(a);
            const double db = plane.dot(b);
            if (da >= 0) kept.corners[kept.size++] = a;
            if ((da >= 0) != (db >= 0)) kept.corners[kept.size++] = a + (b - a) * (da / (da - db));
        }
        *this = kept;
    }
};

}  // namespace

TileProjection::TileProjection(const ScreenCamera& camera, const PixelRect& pixels, double marginPx)
    : width_(pixels.width),
      height_(pixels.height),
      clip_T_world_(camera.clip_T_eye * camera.eye_T_world.matrix()),
      margin_(marginPx) {
    halfWidth_ = 0.5 * camera.pixels.width;
    halfHeight_ = 0.5 * camera.pixels.height;
    offsetX_ = halfWidth_ - pixels.x;
    offsetY_ = halfHeight_ - pixels.y;
    screenReach_ = camera.pixels.width + camera.pixels.height;
    metresPerUnit_ = camera.eye_T_world.linear().rowwise().norm().maxCoeff();
    eye_ = camera.eyeWorld;

    const Mat4d& p = camera.clip_T_eye;
    pixelsPerMetre_ = std::max(halfWidth_ * p.row(0).head<3>().norm(), halfHeight_ * p.row(1).head<3>().norm());
    leastPixelsPerMetre_ = std::min(halfWidth_ * std::abs(p(0, 0)), halfHeight_ * std::abs(p(1, 1)));
    // w = -z and clip z = a z + b, so normalised depth is -a + b / w.
    const double a = p(2, 2);
    const double b = p(2, 3);
    near_ = b / (a - 1);
    far_ = a == -1 ? std::numeric_limits<double>::infinity() : b / (a + 1);
    depthSlope_ = std::abs(b);
    depthNoise_ = 2e-6 / depthSlope_;
    usable_ = p.row(3).transpose() == Vec4d(0, 0, -1, 0) && p(2, 0) == 0 && p(2, 1) == 0 && near_ > 0 && far_ > near_ &&
              width_ > 0 && height_ > 0 && std::isfinite(pixelsPerMetre_);
}

places::Screen TileProjection::screen() const {
    places::Screen screen{.rounding = kRounding * metresPerUnit_,
                          .leastDepth = leastDepth(),
                          .pixelsPerMetre = pixelsPerMetre_,
                          .halfWidth = halfWidth_,
                          .halfHeight = halfHeight_,
                          .offsetX = offsetX_,
                          .offsetY = offsetY_,
                          .margin = margin_};
    std::copy_n(clip_T_world_.data(), 16, screen.clip_T_world);
    std::copy_n(eye_.data(), 3, screen.eye);
    return screen;
}

Footprint TileProjection::footprint(const Mat4d& clip_T_box, const Box& box, double noise) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Footprint result;
    // x and y together: each frame does this for all that it shows.
    using Pair = Eigen::Array2d;
    const Pair half(halfWidth_, halfHeight_), offset(offsetX_, offsetY_);
    Pair lower = Pair::Constant(kInfinity), upper = Pair::Constant(-kInfinity);
    const auto extend = [&](const Vec4d& c) {
        const Pair at = c.head<2>().array() / c.w() * half + offset;
        // What is not a number leaves them as they are.
        lower = lower.cwiseMin(at);
        upper = upper.cwiseMax(at);
    };
    const auto setSides = [&] {
        result.lowerX = lower.x(), result.lowerY = lower.y();
        result.upperX = upper.x(), result.upperY = upper.y();
    };
    const std::array<Vec4d, 8> corners = cornersOf(clip_T_box, box);
    const double limit = leastDepth() + noise;
    double leastW = kInfinity;
    for (const Vec4d& c : corners) {
        leastW = std::min(leastW, c.w());
        result.farthest = std::max(result.farthest, c.w());
        if (c.w() >= limit)
            extend(c);
        else
            result.nearPlane = true;
    }
    if (result.nearPlane) {
        for (unsigned i = 0; i < 8; ++i) {
            for (unsigned axis = 0; axis < 3; ++axis) {
                const Vec4d& a = corners[i];
                const Vec4d& b = corners[i | 1u << axis];
                if ((a.w() >= limit) != (b.w() >= limit)) extend(a + (b - a) * ((limit - a.w()) / (b.w() - a.w())));
            }
        }
        setSides();
        result.grow(margin_);
        result.nearest = kInfinity;
        return result;
    }
    setSides();
    const double nearest = 1 / (leastW - noise);
    result.grow(1 + margin_ + noise * pixelsPerMetre_ * nearest);
    result.nearest = nearer(nearest, noise);
    return result;
}

double TileProjection::coveredPx(const Mat4d& clip_T_box, const Box& box) const {
    constexpr unsigned kFaces[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                       {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
    // Half spaces of clip space: beyond the near plane, then inside the tile's four sides.
    const auto atX = [&](double px) { return (px - offsetX_) / halfWidth_; };
    const auto atY = [&](double px) { return (px - offsetY_) / halfHeight_; };
    const Vec4d sides[4] = {{1, 0, 0, -atX(0)}, {-1, 0, 0, atX(width_)}, {0, 1, 0, -atY(0)}, {0, -1, 0, atY(height_)}};
    const std::array<Vec4d, 8> corners = cornersOf(clip_T_box, box);
    // Front and back faces cover the same; where the near plane takes a part away, those that are left.
    double counterClockwise = 0;
    double clockwise = 0;
    for (const auto& face : kFaces) {
        CutPolygon polygon;
        for (const unsigned corner : face) {
            Vec4d c = corners[corner];
            c.z() = 1;  // of no use here but to carry the constant of the plane w >= near
            polygon.corners[polygon.size++] = c;
        }
        polygon.cut({0, 0, -near_, 1});
        for (const Vec4d& side : sides) polygon.cut(side);
        double area = 0;
        for (std::size_t i = 0; i < polygon.size; ++i) {
            const Vec4d& a = polygon.corners[i];
            const Vec4d& b = polygon.corners[i + 1 == polygon.size ? 0 : i + 1];
            area += 0.5 * (xPx(a.x(), a.w()) * yPx(b.y(), b.w()) - xPx(b.x(), b.w()) * yPx(a.y(), a.w()));
        }
        (area > 0 ? counterClockwise : clockwise) += std::abs(area);
    }
    return std::max(counterClockwise, clockwise);
}

}  // namespace tessera
