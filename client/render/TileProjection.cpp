#include "client/render/TileProjection.h"

#include <cmath>
#include <limits>

namespace tessera {

TileProjection::TileProjection(const ScreenCamera& camera, const PixelRect& pixels)
    : width_(pixels.width), height_(pixels.height), clip_T_world_(camera.clip_T_eye * camera.eye_T_world.matrix()) {
    halfWidth_ = 0.5 * camera.pixels.width;
    halfHeight_ = 0.5 * camera.pixels.height;
    offsetX_ = halfWidth_ - pixels.x;
    offsetY_ = halfHeight_ - pixels.y;
    screenReach_ = camera.pixels.width + camera.pixels.height;
    metresPerUnit_ = camera.eye_T_world.linear().rowwise().norm().maxCoeff();
    eye_ = camera.eyeWorld;

    const Mat4d& p = camera.clip_T_eye;
    pixelsPerMetre_ = std::max(halfWidth_ * p.row(0).head<3>().norm(), halfHeight_ * p.row(1).head<3>().norm());
    // w = -z and clip z = a z + b, so normalised depth is -a + b / w.
    const double a = p(2, 2);
    const double b = p(2, 3);
    near_ = b / (a - 1);
    far_ = b / (a + 1);
    depthSlope_ = std::abs(b);
    depthNoise_ = 2e-6 / depthSlope_;
    usable_ = p.row(3).transpose() == Vec4d(0, 0, -1, 0) && p(2, 0) == 0 && p(2, 1) == 0 && near_ > 0 && far_ > near_ &&
              width_ > 0 && height_ > 0 && std::isfinite(pixelsPerMetre_) && std::isfinite(far_);
}

Footprint TileProjection::footprint(const Mat4d& clip_T_box, const Box& box, double noise) const {
    Footprint result;
    const Vec4d corner = clip_T_box * box.lower.homogeneous();
    const Vec3d size = box.size();
    const Vec4d edge[3] = {clip_T_box.col(0) * size.x(), clip_T_box.col(1) * size.y(), clip_T_box.col(2) * size.z()};
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    double leastW = kInfinity;
    result.lowerX = result.lowerY = kInfinity;
    result.upperX = result.upperY = -kInfinity;
    // Half of the near distance more than needed: nothing is lost, things that close are nearly always visible.
    const double limit = 1.5 * near_ + noise;
    for (unsigned i = 0; i < 8; ++i) {
        Vec4d c = corner;
        if (i & 1) c += edge[0];
        if (i & 2) c += edge[1];
        if (i & 4) c += edge[2];
        if (!(c.w() >= limit)) {
            result.nearPlane = true;
            return result;
        }
        leastW = std::min(leastW, c.w());
        const double x = xPx(c.x(), c.w());
        const double y = yPx(c.y(), c.w());
        result.lowerX = std::min(result.lowerX, x);
        result.upperX = std::max(result.upperX, x);
        result.lowerY = std::min(result.lowerY, y);
        result.upperY = std::max(result.upperY, y);
    }
    const double nearest = 1 / (leastW - noise);
    const double grown = 1 + noise * pixelsPerMetre_ * nearest;
    result.lowerX -= grown;
    result.lowerY -= grown;
    result.upperX += grown;
    result.upperY += grown;
    result.nearest = nearer(nearest, noise);
    return result;
}

}  // namespace tessera
