/// A ray and one triangle; and a ray from afar.
#pragma once

#include <cmath>
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

struct NearRay {
    Ray ray;            ///< on the ray that was asked for, with its direction
    double before = 0;  ///< in lengths of that direction: where it begins there
};

/// The ray from a point that is near a ball and before it: differences of coordinates keep their digits there, however
/// far away the ray begins. One that begins within 16 radii of the centre, by coordinate, stays as it is. Nothing: the
/// ray leads away from the ball, or its t would not be finite. `ray`: finite, with a direction.
[[nodiscard]] inline std::optional<NearRay> begunNear(const Ray& ray, const Vec3d& centre, double radius) {
    constexpr double kFar = 16;
    NearRay out{ray};
    if (!((ray.origin - centre).cwiseAbs().maxCoeff() > kFar * radius)) return out;
    const double longest = ray.direction.cwiseAbs().maxCoeff();
    const Vec3d direction = ray.direction / longest;
    const double square = direction.squaredNorm();
    // The second step mends what rounding has left of the first one.
    for (int step = 0; step < 2; ++step) {
        const double nearest = (centre - out.ray.origin).dot(direction) / square;
        if (step == 0 && !(nearest > 0)) return std::nullopt;
        const double by = (nearest - 2 * radius / std::sqrt(square)) / longest;
        if (!std::isfinite(by)) return std::nullopt;
        // Rounded once: so little off the ray as the new origin's own digits say.
        for (int k = 0; k < 3; ++k) out.ray.origin[k] = std::fma(by, ray.direction[k], out.ray.origin[k]);
        out.before += by;
    }
    return out;
}

/// How far a ray that is begun anew may go so that no t <= maxT is missed; a little more may be found.
[[nodiscard]] inline double limitOf(const NearRay& near, double maxT) {
    return near.before == 0 ? maxT : maxT - near.before + 4e-16 * (std::abs(maxT) + std::abs(near.before));
}

}  // namespace tessera
