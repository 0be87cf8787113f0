#include "common/freeform/BezierPatch.h"

#include <cmath>
#include <utility>

namespace tessera {
namespace {

/// A step of de Casteljau on `count` points that lie `stride` apart, in place; one point fewer counts afterwards.
void casteljauStep(Vec4d* points, int count, std::size_t stride, double t) {
    for (int i = 0; i + 1 < count; ++i) {
        Vec4d& here = points[static_cast<std::size_t>(i) * stride];
        here = (1 - t) * here + t * points[static_cast<std::size_t>(i + 1) * stride];
    }
}

struct CurvePoint {
    Vec4d point, derivative;
};
/// Overwrites the points.
CurvePoint curveAt(Vec4d* points, int degree, double t) {
    if (degree == 0) return {points[0], Vec4d::Zero()};
    for (int count = degree + 1; count > 2; --count) casteljauStep(points, count, 1, t);
    return {(1 - t) * points[0] + t * points[1], degree * (points[1] - points[0])};
}

struct PlainPoint {
    Vec3d point, du, dv;
};
PlainPoint plainAt(const BezierPatch& patch, double u, double v) {
    const auto rows = static_cast<std::size_t>(patch.degreeV + 1);
    std::vector<Vec4d> row, points(rows), along(rows);
    for (int j = 0; j <= patch.degreeV; ++j) {
        const auto first = patch.points.begin() + static_cast<std::ptrdiff_t>(j) * (patch.degreeU + 1);
        row.assign(first, first + patch.degreeU + 1);
        const CurvePoint c = curveAt(row.data(), patch.degreeU, u);
        points[static_cast<std::size_t>(j)] = c.point;
        along[static_cast<std::size_t>(j)] = c.derivative;
    }
    const CurvePoint c = curveAt(points.data(), patch.degreeV, v);
    const Vec4d du = curveAt(along.data(), patch.degreeV, v).point;
    const double w = c.point.w();
    const Vec3d point = c.point.head<3>() / w;
    return {point, (du.head<3>() - du.w() * point) / w, (c.derivative.head<3>() - c.derivative.w() * point) / w};
}

/// Of length 1, or zero where the derivatives span no area to speak of.
Vec3d normalOf(const PlainPoint& p) {
    const Vec3d across = p.du.cross(p.dv);
    const double area = across.norm();
    return area > 1e-10 * p.du.norm() * p.dv.norm() && area > 0 ? Vec3d(across / area) : Vec3d::Zero();
}

/// The normal `step` of the way towards the patch's middle.
Vec3d normalInside(const BezierPatch& patch, double u, double v, double step) {
    return normalOf(plainAt(patch, u + step * (0.5 - u), v + step * (0.5 - v)));
}

}  // namespace

Box boxOf(const BezierPatch& patch) {
    Box box;
    for (const Vec4d& p : patch.points) box.extend(p.head<3>() / p.w());
    return box;
}

SurfacePoint evaluate(const BezierPatch& patch, double u, double v) {
    const PlainPoint plain = plainAt(patch, u, v);
    SurfacePoint p{.point = plain.point, .du = plain.du, .dv = plain.dv, .normal = normalOf(plain)};
    if (p.normal.isZero()) {
        // Two steps and what they tend to; where they disagree, the surface has no normal there.
        constexpr double kStep = 1.0 / (1 << 14);
        const Vec3d far = normalInside(patch, u, v, 2 * kStep), near = normalInside(patch, u, v, kStep);
        const Vec3d limit = 2 * near - far;
        if ((near - far).norm() < 0.01 && limit.norm() > 0.5) p.normal = limit.normalized();
    }
    return p;
}

std::array<BezierPatch, 2> split(const BezierPatch& patch, PatchAxis axis, double t) {
    BezierPatch below = patch, above = patch;
    const bool alongU = axis == PatchAxis::kU;
    const int degree = alongU ? patch.degreeU : patch.degreeV, curves = (alongU ? patch.degreeV : patch.degreeU) + 1;
    const auto rowLength = static_cast<std::size_t>(patch.degreeU + 1);
    const std::size_t stride = alongU ? 1 : rowLength, next = alongU ? rowLength : 1;
    for (int c = 0; c < curves; ++c) {
        Vec4d* const high = above.points.data() + static_cast<std::size_t>(c) * next;
        Vec4d* const low = below.points.data() + static_cast<std::size_t>(c) * next;
        for (int level = 0; level <= degree; ++level) {
            low[static_cast<std::size_t>(level) * stride] = high[0];
            casteljauStep(high, degree + 1 - level, stride, t);
        }
    }
    return {std::move(below), std::move(above)};
}

}  // namespace tessera
