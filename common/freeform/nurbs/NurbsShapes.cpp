#include "common/freeform/nurbs/NurbsShapes.h"

#include <cmath>
#include <utility>

namespace tessera {
namespace {

/// Points (w·r, w·y, w) in the half plane r >= 0, upwards on the outside.
struct Profile {
    KnotVector knots;
    std::vector<Vec3d> points;
};

/// Turned about the y axis from +x over −z, so that du × dv points outwards.
Expected<NurbsSurface> revolved(const Profile& profile, std::vector<TrimLoop> loops) {
    const TrimCurve turn = circle(Vec2d::Zero(), 1);
    NurbsDefinition d{
        .u = turn.knots, .v = profile.knots, .points = {}, .rangeU = {}, .rangeV = {}, .loops = std::move(loops)};
    for (const Vec3d& p : profile.points)
        for (const Vec3d& c : turn.points)
            d.points.emplace_back(c.x() * p.x(), c.z() * p.y(), -c.y() * p.x(), c.z() * p.z());
    return NurbsSurface::make(std::move(d));
}

}  // namespace

Expected<NurbsSurface> sphereSurface(double radius, std::vector<TrimLoop> loops) {
    const double w = std::sqrt(0.5), r = radius;
    return revolved({.knots = {.degree = 2, .knots = {0, 0, 0, 1, 1, 2, 2, 2}},
                     .points = {{0, -r, 1}, {w * r, -w * r, w}, {r, 0, 1}, {w * r, w * r, w}, {0, r, 1}}},
                    std::move(loops));
}

Expected<NurbsSurface> torusSurface(double radius, double tubeRadius, std::vector<TrimLoop> loops) {
    const TrimCurve tube = circle({radius, 0}, tubeRadius);
    return revolved({.knots = tube.knots, .points = tube.points}, std::move(loops));
}

Expected<NurbsSurface> cylinderSurface(double radius, double height, std::vector<TrimLoop> loops) {
    return coneSurface(radius, radius, height, std::move(loops));
}

Expected<NurbsSurface> coneSurface(double lowerRadius, double upperRadius, double height, std::vector<TrimLoop> loops) {
    return revolved(
        {.knots = {.degree = 1, .knots = {0, 0, 1, 1}}, .points = {{lowerRadius, 0, 1}, {upperRadius, height, 1}}},
        std::move(loops));
}

}  // namespace tessera
