/// A ray and one triangle.
#pragma once

#include <optional>

#include "common/math/Ray.h"
#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

/// Where along the ray, in lengths of its direction; from either side (T. Möller, B. Trumbore, "Fast, Minimum Storage
/// Ray/Triangle Intersection", 1997). Nothing for a triangle seen from its edge.
[[nodiscard]] inline std::optional<double> whereRayMeets(const Triangle& t, const Ray& ray) {
    const Vec3d e1 = t[1] - t[0], e2 = t[2] - t[0];
    const Vec3d p = ray.direction.cross(e2);
    const double det = e1.dot(p);
    if (det == 0) return std::nullopt;
    const Vec3d s = ray.origin - t[0];
    const double u = s.dot(p) / det;
    // A hair of slack, so that a ray along a common edge does not slip between two faces.
    constexpr double kSlack = 1e-12;
    if (!(u >= -kSlack && u <= 1 + kSlack)) return std::nullopt;
    const Vec3d q = s.cross(e1);
    const double v = ray.direction.dot(q) / det;
    if (!(v >= -kSlack && u + v <= 1 + kSlack)) return std::nullopt;
    const double at = e2.dot(q) / det;
    return at >= 0 ? std::optional<double>(at) : std::nullopt;
}

}  // namespace tessera
