/// Surfaces beside their closed forms: points, normals, areas, trimmed ones by circles too.
#include "common/freeform/nurbs/NurbsShapes.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <numbers>

#include "tests/support/words/Words.h"
#include "tests/unit/nurbs/NurbsOracle.h"
#include "tests/unit/nurbs/Plane.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

/// Every point's distance from the closed form and the angle of its normal, over a grid that has all joints, edges and
/// poles.
void isThe(const Expected<NurbsSurface>& made, double size, const std::function<double(const Vec3d&)>& distance,
           const std::function<Vec3d(const Vec3d&)>& normal) {
    ASSERT_TRUE(made) << made.error().message;
    const ParameterRectangle& domain = made->domain();
    constexpr int kSteps = 64;
    for (int j = 0; j <= kSteps; ++j)
        for (int i = 0; i <= kSteps; ++i) {
            const NurbsPoint p = evaluate(*made, domain.u.lower + domain.u.size() * i / kSteps,
                                          domain.v.lower + domain.v.size() * j / kSteps);
            ASSERT_EQ(p.side, TrimSide::kKept);
            ASSERT_LT(std::abs(distance(p.at.point)), 1e-15 * 50 * size) << i << " " << j;
            // At a pole the normal is a limit: two steps of 2^-14 leave their square, 1e-8.
            const bool pole = std::min(p.at.du.norm(), p.at.dv.norm()) < 1e-9 * size;
            ASSERT_LT((p.at.normal - normal(p.at.point)).norm(), pole ? 1e-7 : 1e-12) << i << " " << j;
        }
}

TEST(NurbsShapes, AreTheirClosedForms) {
    const auto radial = [](const Vec3d& p) { return Vec3d(p.x(), 0, p.z()); };
    for (const double size : {1.0, 1e-6, 1e9}) {
        isThe(
            sphereSurface(size), size, [&](const Vec3d& p) { return p.norm() - size; },
            [](const Vec3d& p) { return p.normalized(); });
        const double tube = 0.3 * size;
        const auto toTube = [&](const Vec3d& p) { return Vec3d(p - size * radial(p).normalized()); };
        isThe(
            torusSurface(size, tube), size, [&](const Vec3d& p) { return toTube(p).norm() - tube; },
            [&](const Vec3d& p) { return toTube(p).normalized(); });
        isThe(
            cylinderSurface(size, 2 * size), size, [&](const Vec3d& p) { return radial(p).norm() - size; },
            [&](const Vec3d& p) { return radial(p).normalized(); });
        // From radius 1 to the tip at height 2: the slope is 2 down for 1 outwards.
        const auto outwards = [&](const Vec3d& p) {
            return Vec3d((2 * radial(p).normalized() + Vec3d::UnitY()).normalized());
        };
        const double lower = size, height = 2 * size;
        isThe(
            coneSurface(lower, 0.25 * size, 1.5 * size), size,
            [&](const Vec3d& p) { return radial(p).norm() - (lower - p.y() / 2); }, outwards);
        isThe(
            planeSurface({{-size, size}, {0, size}}), size, [](const Vec3d& p) { return p.z(); },
            [](const Vec3d&) { return Vec3d::UnitZ(); });
        // The tip of a whole cone: a normal of the side that one comes along, whichever u.
        const NurbsPoint tip = evaluate(*coneSurface(lower, 0, height), 0.5, 1);
        EXPECT_LT((tip.at.normal - Vec3d(2 * std::sqrt(0.5), 1, -2 * std::sqrt(0.5)).normalized()).norm(), 1e-7);
    }
    EXPECT_FALSE(sphereSurface(std::numeric_limits<double>::infinity()));
    EXPECT_FALSE(planeSurface({{1, 0}, {0, 1}}));
}

/// Gauss-Legendre with 8 points per side.
double areaOver(const NurbsSurface& surface, const ParameterRectangle& r) {
    static constexpr std::array<double, 4> kAt = {0.18343464249564980494, 0.52553240991632898582,
                                                  0.79666647741362673959, 0.96028985649753623168};
    constexpr std::array<double, 4> kWeight = {0.36268378337836198297, 0.31370664587788728734, 0.22238103445337447054,
                                               0.10122853629037625915};
    double area = 0;
    for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b) {
            const auto at = [](int k, const ParameterRange& range) {
                return range.lower +
                       range.size() * (0.5 + (k % 2 == 0 ? 0.5 : -0.5) * kAt[static_cast<std::size_t>(k / 2)]);
            };
            const SurfacePoint p = evaluate(surface, at(a, r.u), at(b, r.v)).at;
            area += kWeight[static_cast<std::size_t>(a / 2)] * kWeight[static_cast<std::size_t>(b / 2)] *
                    p.du.cross(p.dv).norm();
        }
    return area * r.u.size() * r.v.size() / 4;
}
struct AreaBounds {
    double kept = 0, unsure = 0;
};
/// What surely is kept, and what the last cells along the curves hold: some two cells' width along each curve.
void addArea(const NurbsSurface& surface, const ParameterRectangle& r, int depth, AreaBounds& bounds) {
    const RectangleSide side = surface.region().side(r);
    if (side == RectangleSide::kTrimmedAway) return;
    if (depth == 0) {
        (side == RectangleSide::kKept ? bounds.kept : bounds.unsure) += areaOver(surface, r);
        return;
    }
    if (side == RectangleSide::kKept) depth = std::min(depth, 3);  // cells of an eighth suffice for the quadrature
    const double u = 0.5 * (r.u.lower + r.u.upper), v = 0.5 * (r.v.lower + r.v.upper);
    for (const ParameterRange& alongU : {ParameterRange{r.u.lower, u}, ParameterRange{u, r.u.upper}})
        for (const ParameterRange& alongV : {ParameterRange{r.v.lower, v}, ParameterRange{v, r.v.upper}})
            addArea(surface, {alongU, alongV}, depth - 1, bounds);
}
void hasArea(const Expected<NurbsSurface>& surface, double area, int depth, double unsureShare) {
    ASSERT_TRUE(surface) << surface.error().message;
    AreaBounds bounds;
    for (const ParameterPatch& p : bezierPatches(*surface)) addArea(*surface, p.over, depth, bounds);
    EXPECT_LE(bounds.kept, area * (1 + 1e-9));
    EXPECT_GE(bounds.kept + bounds.unsure, area * (1 - 1e-9));
    EXPECT_LE(bounds.unsure, unsureShare * area);
}
TrimLoop rectangleLoop(LoopRole role, const ParameterRectangle& r) {
    const std::array<Vec2d, 5> corners = {Vec2d(r.u.lower, r.v.lower), Vec2d(r.u.upper, r.v.lower),
                                          Vec2d(r.u.upper, r.v.upper), Vec2d(r.u.lower, r.v.upper),
                                          Vec2d(r.u.lower, r.v.lower)};
    return {role, {polyline(corners)}};
}

TEST(NurbsShapes, HaveTheAreasOfTheirClosedForms) {
    hasArea(sphereSurface(2), 16 * kPi, 3, 0);
    hasArea(torusSurface(3, 1), 12 * kPi * kPi, 3, 0);
    hasArea(cylinderSurface(2, 5), 20 * kPi, 3, 0);
    hasArea(coneSurface(3, 0, 4), 15 * kPi, 3, 0);
    hasArea(planeSurface({{0, 2}, {-1, 4}}), 10, 3, 0);
}

TEST(NurbsShapes, TrimmedByLinesAndCirclesHaveTheAreasOfTheirClosedForms) {
    // A quarter of a zone: v is the tangent of half the latitude on the rational quarter circle, 1 at the equator; to
    // 30 degrees above it.
    const double w = std::sqrt(0.5), t = [&] {
        double low = 0, high = 1;  // the parameter where the quarter circle is at height 1/2
        for (int k = 0; k < 60; ++k) {
            const double m = 0.5 * (low + high), y = 2 * w * m * (1 - m) + m * m,
                         weight = (1 - m) * (1 - m) + 2 * w * m * (1 - m) + m * m;
            (y / weight < 0.5 ? low : high) = m;
        }
        return low;
    }();
    hasArea(sphereSurface(1, {rectangleLoop(LoopRole::kOuter, {{1, 2}, {1, 1 + t}})}), kPi / 4, 7, 0.12);
    hasArea(planeSurface({{-2, 2}, {-2, 2}}, {{LoopRole::kOuter, {circle({0.3, -0.2}, 1.5)}}}), 2.25 * kPi, 7, 0.06);
    hasArea(planeSurface({{-2, 2}, {-2, 2}}, {{LoopRole::kHole, {circle({0.3, -0.2}, 1.5)}}}), 16 - 2.25 * kPi, 7,
            0.06);
    hasArea(planeSurface({{-2, 2}, {-2, 2}}, {{LoopRole::kOuter, {circle({0, 0}, 1.9)}},
                                              {LoopRole::kHole, {circle({0.5, 0.5}, 1)}},
                                              {LoopRole::kOuter, {circle({0.5, 0.4}, 0.5)}}}),
            (1.9 * 1.9 - 1 + 0.25) * kPi, 8, 0.06);
}

/// The unit sphere by stereographic projection from (0, 0, −1): (2u, 2v, 1 − u² − v²) / (1 + u² + v²) for u and v from
/// −a to a. Circles of the parameters are circles of the sphere.
Expected<NurbsSurface> stereographicSphere(double a, std::vector<TrimLoop> loops) {
    NurbsDefinition d{.u = {2, {-a, -a, -a, a, a, a}},
                      .v = {2, {-a, -a, -a, a, a, a}},
                      .points = {},
                      .rangeU = {},
                      .rangeV = {},
                      .loops = std::move(loops)};
    // Blossoms: of t it is the mean of its arguments, of t² their product.
    const std::array<double, 3> line = {-a, 0, a}, square = {a * a, -a * a, a * a};
    for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3; ++i)
            d.points.emplace_back(2 * line[i], 2 * line[j], 1 - square[i] - square[j], 1 + square[i] + square[j]);
    return NurbsSurface::make(std::move(d));
}

TEST(NurbsShapes, ASphereTrimmedByACircleIsACap) {
    for (const auto& [center, radius] :
         {std::pair(Vec2d(0, 0), 0.55), std::pair(Vec2d(0.2, -0.1), 0.35), std::pair(Vec2d(-0.3, 0.3), 0.25)}) {
        // On the line through the origin the circle's ends are at twice these angles from the pole.
        const double cap = std::atan(center.norm() + radius) - std::atan(center.norm() - radius);
        hasArea(stereographicSphere(0.6, {{LoopRole::kOuter, {circle(center, radius)}}}), 2 * kPi * (1 - std::cos(cap)),
                7, 0.1);
    }
    // Over a larger square the middle weight, 1 − 2 a², is below 0: another net of the same surface would do, this one
    // is refused.
    const Expected<NurbsSurface> large = stereographicSphere(1.5, {});
    ASSERT_FALSE(large);
    EXPECT_WORDS(large.error().message);
}

}  // namespace
}  // namespace tessera
