/// Distances of points from triangles and hulls in long double, by the plainest ways.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera::oracle {

using Real = long double;
using Vec = Eigen::Matrix<Real, 3, 1>;

inline Vec exact(const Vec3d& p) {
    return p.cast<Real>();
}

inline Real fromSegment(const Vec& p, const Vec& a, const Vec& b) {
    const Vec ab = b - a;
    const Real length2 = ab.squaredNorm();
    const Real t = length2 > 0 ? std::clamp(ab.dot(p - a) / length2, Real{0}, Real{1}) : 0;
    return (p - a - t * ab).norm();
}

inline Real fromTriangle(const Vec3d& point, const Triangle& t) {
    const Vec p = exact(point), a = exact(t[0]), b = exact(t[1]), c = exact(t[2]);
    const Vec n = (b - a).cross(c - a);
    Real least = std::min({fromSegment(p, a, b), fromSegment(p, b, c), fromSegment(p, c, a)});
    const Real area2 = n.squaredNorm(), size2 = std::max((b - a).squaredNorm(), (c - a).squaredNorm());
    // Above the inside: the foot is on the inner side of every edge. (Flattened triangles are their edges.)
    if (area2 > 1e-28L * size2 * size2 && n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
        n.dot((a - c).cross(p - c)) >= 0)
        least = std::min(least, std::abs(n.dot(p - a)) / std::sqrt(area2));
    return least;
}

/// Of the hull as it is mapped: how far outside; below 0: how deep within, by the nearest side.
inline Real fromHull(const Vec3d& point, const ConvexHull& hull, const Affine3d& map) {
    const auto at = [&](std::uint32_t i) -> Vec3d { return map * hull.vertices()[i]; };
    const Vec p = exact(point), middle = exact(map * hull.centre());
    Real surface = std::numeric_limits<Real>::infinity(), inside = surface;
    for (const ConvexHull::Face& f : hull.faces()) {
        const Triangle t{at(f[0]), at(f[1]), at(f[2])};
        surface = std::min(surface, fromTriangle(point, t));
        Vec n = (exact(t[1]) - exact(t[0])).cross(exact(t[2]) - exact(t[0]));
        if (n.norm() == 0) continue;
        n /= n.norm();
        if (n.dot(middle - exact(t[0])) > 0) n = -n;
        inside = std::min(inside, n.dot(exact(t[0]) - p));
    }
    if (hull.faces().empty()) {
        const auto last = static_cast<std::uint32_t>(hull.vertices().size() - 1);
        return fromSegment(p, exact(at(0)), exact(at(last)));
    }
    return hull.dimension() == 3 && inside > 0 ? -inside : surface;
}

/// The power method, each step squaring the matrix.
inline double largestSingularValue(const Mat3d& m) {
    const Eigen::Matrix<Real, 3, 3> gram = m.cast<Real>().transpose() * m.cast<Real>();
    if (gram.norm() == 0) return 0;
    Eigen::Matrix<Real, 3, 3> power = gram / gram.norm();
    for (int i = 0; i < 80; ++i) {
        power = (power * power).eval();
        power /= power.norm();
    }
    int column = 0;
    power.colwise().norm().maxCoeff(&column);
    const Vec v = power.col(column).normalized();
    return static_cast<double>(std::sqrt(v.dot(gram * v)));
}

}  // namespace tessera::oracle
