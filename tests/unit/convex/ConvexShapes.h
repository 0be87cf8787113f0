/// Point sets to take hulls of, and random poses.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "server/collision/convex/ConvexHull.h"

namespace tessera::convextest {

using Points = std::vector<Vec3d>;
using Random = std::mt19937_64;

inline ConvexHull hullOf(const Points& points) {
    Expected<ConvexHull> hull = ConvexHull::make(points);
    EXPECT_TRUE(hull.has_value()) << (hull ? "" : hull.error().message);
    return std::move(*hull);
}

inline Points box(const Vec3d& size) {
    Points out;
    for (int i = 0; i < 8; ++i)
        out.emplace_back((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(),
                         (i & 4 ? 0.5 : -0.5) * size.z());
    return out;
}

/// A spiral of nearly even points on a sphere (R. Swinbank, R. J. Purser, "Fibonacci Grids", 2006).
inline Points sphere(double radius, int count) {
    Points out;
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        const double z = 1 - (2.0 * i + 1) / count, r = std::sqrt(1 - z * z);
        out.push_back(radius * Vec3d(r * std::cos(golden * i), r * std::sin(golden * i), z));
    }
    return out;
}

/// An upright prism over a regular polygon: long edges, sides of many corners in one plane (to rounding).
inline Points prism(double radius, double height, int corners) {
    Points out;
    for (int i = 0; i < corners; ++i) {
        const double phi = 2 * std::numbers::pi * i / corners;
        for (const double z : {-0.5 * height, 0.5 * height})
            out.emplace_back(radius * std::cos(phi), radius * std::sin(phi), z);
    }
    return out;
}

inline Vec3d normalVector(Random& random) {
    std::normal_distribution<double> n;
    const double x = n(random), y = n(random), z = n(random);
    return {x, y, z};
}
inline Vec3d unitVector(Random& random) {
    return normalVector(random).normalized();
}

inline Points cloud(int count, Random& random) {
    Points out;
    const Vec3d stretch = (normalVector(random).cwiseAbs().array() + 0.2).matrix();
    for (int i = 0; i < count; ++i) out.push_back(normalVector(random).cwiseProduct(stretch));
    return out;
}

inline Quatd rotation(Random& random) {
    std::normal_distribution<double> n;
    const double w = n(random), x = n(random), y = n(random), z = n(random);
    return Quatd(w, x, y, z).normalized();
}

inline Points moved(const Affine3d& m, const Points& points) {
    Points out;
    for (const Vec3d& p : points) out.push_back(m * p);
    return out;
}

/// A body of every kind, by number: from a point to hundreds of corners.
inline Points anyBody(int kind, Random& random) {
    switch (kind % 10) {
        case 0:
            return box(Vec3d(1, 2, 3));
        case 1:
            return cloud(4, random);
        case 2:
            return cloud(20, random);
        case 3:
            return sphere(1.5, 300);
        case 4:
            return prism(1, 3, 24);
        case 5: {  // a polygon
            Points p = cloud(9, random);
            for (Vec3d& v : p) v.z() = 0;
            return p;
        }
        case 6:
            return {Vec3d(-1, 0, 0), Vec3d(1.5, 0.5, 0.25)};
        case 7:
            return {normalVector(random)};
        case 8:  // a thin plate
            return box(Vec3d(3, 2, 1e-3));
        default:
            return cloud(200, random);
    }
}

}  // namespace tessera::convextest
