/// Distances over all pairs of triangles, depths over all directions.
#pragma once

#include <limits>
#include <vector>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/TriangleContact.h"

namespace tessera::convextest {

/// The surface; the hull itself where it is flat.
inline std::vector<Triangle> trianglesOf(const ConvexHull& hull, const Affine3d& m = Affine3d::Identity()) {
    std::vector<Triangle> out;
    const auto v = [&](std::uint32_t i) -> Vec3d { return m * hull.vertices()[i]; };
    for (const ConvexHull::Face& f : hull.faces()) out.push_back({v(f[0]), v(f[1]), v(f[2])});
    if (hull.dimension() < 2) {
        const auto last = static_cast<std::uint32_t>(hull.vertices().size() - 1);
        out.push_back({v(0), v(last), v(last)});
    }
    return out;
}

/// Of hulls that do not meet.
inline double bruteDistance(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b) {
    double least = std::numeric_limits<double>::infinity();
    const std::vector<Triangle> ofB = trianglesOf(b, a_T_b);
    for (const Triangle& s : trianglesOf(a))
        for (const Triangle& t : ofB) least = std::min(least, nearestPoints(s, t).distance);
    return least;
}

/// Surfaces that cross, or a corner of one inside the other. Right where rounding of B's vertices decides nothing.
inline bool bruteTouching(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b) {
    const std::vector<Triangle> ofB = trianglesOf(b, a_T_b);
    for (const Triangle& s : trianglesOf(a))
        for (const Triangle& t : ofB)
            if (trianglesIntersect(s, t)) return true;
    return a.contains(a_T_b * b.vertices()[0]) || b.contains(a_T_b.inverse() * a.vertices()[0]);
}

inline double extent(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, const Vec3d& n) {
    double high = -std::numeric_limits<double>::infinity(), low = std::numeric_limits<double>::infinity();
    for (const Vec3d& v : a.vertices()) high = std::max(high, n.dot(v));
    for (const Vec3d& v : b.vertices()) low = std::min(low, n.dot(a_T_b * v));
    return high - low;
}

/// The least way out of two bodies: sides of their difference lie along a side of either or along two edges.
inline double bruteDepth(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b) {
    double least = std::numeric_limits<double>::infinity();
    const auto offer = [&](const Vec3d& n) {
        if (!(n.norm() > 1e-9)) return;
        least = std::min({least, extent(a, b, a_T_b, n.normalized()), extent(a, b, a_T_b, -n.normalized())});
    };
    const auto edges = [](const ConvexHull& hull, const Affine3d& m) {
        std::vector<Vec3d> out;
        for (std::uint32_t v = 0; v < hull.vertices().size(); ++v)
            for (const std::uint32_t n : hull.neighbours(v))
                if (v < n) out.push_back((m.linear() * (hull.vertices()[n] - hull.vertices()[v])).normalized());
        return out;
    };
    for (const Triangle& t : trianglesOf(a)) offer(outside(t));
    for (const Triangle& t : trianglesOf(b, a_T_b)) offer(outside(t));
    const std::vector<Vec3d> ofB = edges(b, a_T_b);
    for (const Vec3d& e : edges(a, Affine3d::Identity()))
        for (const Vec3d& f : ofB) offer(e.cross(f));
    return least;
}

}  // namespace tessera::convextest
