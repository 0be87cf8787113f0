#include "common/freeform/BezierPatch.h"

#include <algorithm>
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

/// The Bernstein polynomials of a degree at t, and their derivatives: by the triangle, convex sums in [0, 1].
class BernsteinBasis {
public:
    BernsteinBasis(int degree, double t) {
        const auto count = static_cast<std::size_t>(degree) + 1;
        if (count > kSmall) large_.resize(2 * count);
        value_ = count > kSmall ? large_.data() : small_.data();
        derivative_ = value_ + (count > kSmall ? count : kSmall);
        value_[0] = 1;
        for (int d = 1; d <= degree; ++d) {
            if (d == degree)
                for (int i = 0; i <= degree; ++i)
                    derivative_[i] = degree * ((i > 0 ? value_[i - 1] : 0) - (i < degree ? value_[i] : 0));
            value_[d] = 0;
            for (int i = d; i > 0; --i) value_[i] = (1 - t) * value_[i] + t * value_[i - 1];
            value_[0] *= 1 - t;
        }
    }
    BernsteinBasis(const BernsteinBasis&) = delete;
    BernsteinBasis& operator=(const BernsteinBasis&) = delete;
    [[nodiscard]] double value(int i) const { return value_[i]; }
    [[nodiscard]] double derivative(int i) const { return derivative_[i]; }

private:
    static constexpr std::size_t kSmall = 8;  // most patches are bicubic: no memory is asked for
    std::array<double, 2 * kSmall> small_{};
    std::vector<double> large_;
    double* value_;
    double* derivative_;
};

struct PlainPoint {
    Vec3d point, du, dv;
    double reach;  // the largest side of the control points' box
};
PlainPoint plainAt(const BezierPatch& patch, double u, double v) {
    const BernsteinBasis alongU(patch.degreeU, u), alongV(patch.degreeV, v);
    Vec4d point = Vec4d::Zero(), du = Vec4d::Zero(), dv = Vec4d::Zero();
    const Vec4d* control = patch.points.data();
    Box around;
    for (int j = 0; j <= patch.degreeV; ++j) {
        Vec4d inRow = Vec4d::Zero(), slope = Vec4d::Zero();
        for (int i = 0; i <= patch.degreeU; ++i, ++control) {
            inRow += alongU.value(i) * *control;
            slope += alongU.derivative(i) * *control;
            around.extend(control->head<3>() * (1 / control->w()));
        }
        point += alongV.value(j) * inRow;
        du += alongV.value(j) * slope;
        dv += alongV.derivative(j) * inRow;
    }
    const double w = point.w();
    const Vec3d plain = point.head<3>() / w;
    return {plain, (du.head<3>() - du.w() * plain) / w, (dv.head<3>() - dv.w() * plain) / w, around.size().maxCoeff()};
}

/// Whether both derivatives are more than what rounding leaves of nothing, beside what their control points could make
/// of them.
bool haveDirections(const BezierPatch& patch, const PlainPoint& p) {
    constexpr double kNothing = 1e-9, kClearly = 1e-6;
    if (std::min(p.du.cwiseAbs().maxCoeff(), p.dv.cwiseAbs().maxCoeff()) > kClearly * p.reach) return true;
    double alongU = 0, alongV = 0;
    for (int j = 0; j <= patch.degreeV; ++j)
        for (int i = 0; i <= patch.degreeU; ++i) {
            const Vec3d here = patch.at(i, j).head<3>() / patch.at(i, j).w();
            if (i < patch.degreeU)
                alongU = std::max(alongU,
                                  (patch.at(i + 1, j).head<3>() / patch.at(i + 1, j).w() - here).cwiseAbs().maxCoeff());
            if (j < patch.degreeV)
                alongV = std::max(alongV,
                                  (patch.at(i, j + 1).head<3>() / patch.at(i, j + 1).w() - here).cwiseAbs().maxCoeff());
        }
    return p.du.cwiseAbs().maxCoeff() > kNothing * patch.degreeU * alongU &&
           p.dv.cwiseAbs().maxCoeff() > kNothing * patch.degreeV * alongV;
}

/// The normal `step` of the way towards the patch's middle.
Vec3d normalInside(const BezierPatch& patch, double u, double v, double step) {
    const PlainPoint p = plainAt(patch, u + step * (0.5 - u), v + step * (0.5 - v));
    return normalAlong(p.du, p.dv);
}

}  // namespace

Box boxOf(const BezierPatch& patch) {
    Box box;
    for (const Vec4d& p : patch.points) box.extend(p.head<3>() / p.w());
    return box;
}

SurfacePoint evaluate(const BezierPatch& patch, double u, double v) {
    const PlainPoint plain = plainAt(patch, u, v);
    SurfacePoint p{.point = plain.point, .du = plain.du, .dv = plain.dv, .normal = Vec3d::Zero()};
    if (haveDirections(patch, plain)) p.normal = normalAlong(plain.du, plain.dv);
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
