/// What the walks through pairs of parts have in common. For the queries of this library.
#pragma once

#include <algorithm>
#include <limits>

#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/freeform/PartBounds.h"

namespace tessera {

/// Its points are those of parameters; of groups and neighbourhoods there is but the sample.
[[nodiscard]] inline bool hasParameters(const FreeformPart& part) {
    return part.kind == FreeformPart::Kind::kPatch || part.kind == FreeformPart::Kind::kTriangle;
}

[[nodiscard]] inline bool isFace(const FreeformPart& part) {
    return part.kind != FreeformPart::Kind::kGroup;
}

/// Which of two is halved: the larger. But groups, whose parts are there already, while they are not much smaller; and
/// groups that are hardly more than a point, which nothing that is halved becomes as small as.
[[nodiscard]] inline bool dividesA(const FreeformPart& a, const FreeformPart& b, const PartBounds& bounds) {
    constexpr double kMuchSmaller = 0.25, kPoint = 1e-6;
    const double reachA = bounds.radiusA(a), reachB = bounds.radiusB(b);
    if (isFace(a) == isFace(b)) return reachA >= reachB;
    const double face = isFace(a) ? reachA : reachB, group = isFace(a) ? reachB : reachA;
    const bool dividesFace = group < kMuchSmaller * face && group > kPoint * face;
    return dividesFace == isFace(a);
}

[[nodiscard]] inline FreeformPlace placeOf(const FreeformPart& part, const Vec2d& at, const Vec3d& point,
                                           const Vec3d& normal) {
    const Vec2d uv = part.origin + at.x() * part.alongU + at.y() * part.alongV;
    return {.face = part.face, .u = uv.x(), .v = uv.y(), .point = point, .normal = normal};
}

/// From A to B at a place where they meet: along the difference of the normals; of surfaces that are wound alike A's,
/// else the way between.
[[nodiscard]] inline Vec3d contactNormal(const Vec3d& ofA, const Vec3d& ofB, const Vec3d& between) {
    const Vec3d difference = ofA - ofB;
    if (difference.norm() > 1e-6) return difference.normalized();
    if (!ofA.isZero()) return ofA;
    return between.norm() > 0 ? Vec3d(between.normalized()) : Vec3d(Vec3d::UnitX());
}

/// No coordinate that arises in the shared frame is larger. Infinite where a map is not finite.
[[nodiscard]] inline double reachOf(const FreeformShape& shape, const Affine3d& map) {
    const Box box = shape.bounds();
    const Vec3d far = box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs());
    const Vec3d reach = map.linear().cwiseAbs() * far + map.translation().cwiseAbs();
    return reach.allFinite() ? reach.maxCoeff() : std::numeric_limits<double>::infinity();
}

}  // namespace tessera
