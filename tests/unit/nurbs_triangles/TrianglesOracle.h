/// What the tests of this folder judge triangles by: their edges as places, their distance to points, their area in the
/// parameters.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>

#include "common/freeform/nurbs/tessellation/NurbsTriangles.h"

namespace tessera {

struct PlaceOrder {
    bool operator()(const Vec3d& a, const Vec3d& b) const {
        return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    }
};

/// Edges of triangles of one or more surfaces, their ends told by the bits of their places.
class EdgeCount {
public:
    void add(const NurbsTriangles& t, bool turned = false) {
        for (const auto& corners : t.triangles)
            for (std::size_t i = 0; i < 3; ++i) {
                const std::pair edge{number(t.positions[corners[i]]), number(t.positions[corners[(i + 1) % 3]])};
                ++times_[turned ? std::pair{edge.second, edge.first} : edge];
            }
    }
    /// Edges used in one direction alone, or more than once in one.
    [[nodiscard]] std::size_t wrong() const {
        std::size_t count = 0;
        for (const auto& [edge, times] : times_) count += times != 1 || !times_.contains({edge.second, edge.first});
        return count;
    }

private:
    std::size_t number(const Vec3d& p) { return numbers_.try_emplace(p, numbers_.size()).first->second; }
    std::map<Vec3d, std::size_t, PlaceOrder> numbers_;
    std::map<std::pair<std::size_t, std::size_t>, int> times_;
};

/// Ericson, Real-Time Collision Detection, 5.1.5: by the region of the triangle's plane that the point is in.
inline double distanceToTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return ap.norm();
    if (d3 >= 0 && d4 <= d3) return bp.norm();
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - d1 / (d1 - d3) * ab).norm();
    if (d6 >= 0 && d5 <= d6) return cp.norm();
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - d2 / (d2 - d6) * ac).norm();
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return (bp - (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b)).norm();
    return (ap - (ab * vb + ac * vc) / (va + vb + vc)).norm();
}
inline double distanceTo(const NurbsTriangles& t, const Vec3d& p) {
    double least = 1e300;
    for (const auto& corner : t.triangles)
        least = std::min(least,
                         distanceToTriangle(p, t.positions[corner[0]], t.positions[corner[1]], t.positions[corner[2]]));
    return least;
}

inline double areaOf(const NurbsTriangles& t) {
    double area = 0;
    for (const auto& c : t.triangles)
        area += 0.5 * (t.positions[c[1]] - t.positions[c[0]]).cross(t.positions[c[2]] - t.positions[c[0]]).norm();
    return area;
}
/// Of a triangle, by its corners' parameters: above 0 if it is counterclockwise.
inline double parameterArea(const NurbsTriangles& t, const std::array<std::uint32_t, 3>& c) {
    const Vec2d ab = t.parameters[c[1]] - t.parameters[c[0]], ac = t.parameters[c[2]] - t.parameters[c[0]];
    return 0.5 * (ab.x() * ac.y() - ab.y() * ac.x());
}

inline std::uint64_t hashOf(const NurbsTriangles& t) {
    std::uint64_t hash = 0xcbf29ce484222325ull;  // FNV-1a
    const auto take = [&hash](const void* bytes, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i)
            hash = (hash ^ static_cast<const unsigned char*>(bytes)[i]) * 0x100000001b3ull;
    };
    for (const Vec3d& p : t.positions) take(p.data(), 24);
    for (const auto& c : t.triangles) take(c.data(), 12);
    return hash;
}

}  // namespace tessera
