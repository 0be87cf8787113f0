/// Do the hulls of two sets of integer points meet? Without any hull: a hull is the union of the tetrahedra of its
/// points.
#pragma once

#include <vector>

#include "server/collision/convex/ConvexHull.h"
#include "tests/unit/collision/RationalOracle.h"

namespace tessera::convextest {

using IntPoints = std::vector<oracle::Point>;

inline std::vector<Vec3d> toDouble(const IntPoints& points) {
    std::vector<Vec3d> out;
    for (const oracle::Point& p : points) out.push_back(oracle::toDouble(p));
    return out;
}

/// All triples, equal points allowed, so that one or two points make a triangle too.
inline std::vector<oracle::IntTriangle> triplesOf(const IntPoints& p) {
    std::vector<oracle::IntTriangle> out;
    for (std::size_t i = 0; i < p.size(); ++i)
        for (std::size_t j = i + 1; j < p.size(); ++j)
            for (std::size_t k = j + 1; k < p.size(); ++k) out.push_back({p[i], p[j], p[k]});
    if (p.size() < 3) out.push_back({p.front(), p.back(), p.back()});
    return out;
}

inline bool inSomeTetrahedron(const oracle::Point& q, const IntPoints& p) {
    for (std::size_t i = 0; i < p.size(); ++i)
        for (std::size_t j = i + 1; j < p.size(); ++j)
            for (std::size_t k = j + 1; k < p.size(); ++k)
                for (std::size_t l = k + 1; l < p.size(); ++l) {
                    const int whole = oracle::orient3d(p[i], p[j], p[k], p[l]);
                    if (whole != 0 && oracle::orient3d(p[i], p[j], p[k], q) * whole >= 0 &&
                        oracle::orient3d(p[j], p[i], p[l], q) * whole >= 0 &&
                        oracle::orient3d(p[i], p[k], p[l], q) * whole >= 0 &&
                        oracle::orient3d(p[k], p[j], p[l], q) * whole >= 0)
                        return true;
                }
    return false;
}

/// Sides of the hulls are among the triples' triangles, so hulls that meet have triples that do, or one lies inside the
/// other, and so does any point of it.
inline bool hullsMeet(const IntPoints& a, const IntPoints& b) {
    const std::vector<oracle::IntTriangle> ofB = triplesOf(b);
    for (const oracle::IntTriangle& s : triplesOf(a))
        for (const oracle::IntTriangle& t : ofB)
            if (oracle::trianglesMeet(s, t)) return true;
    return inSomeTetrahedron(b.front(), a) || inSomeTetrahedron(a.front(), b);
}

}  // namespace tessera::convextest
