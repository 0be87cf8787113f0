/// Exact answers on integer coordinates, found in another way than the library's: by parts of triangles, with __int128.
#pragma once

#include <array>
#include <cstdint>

#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera::oracle {

__extension__ using Wide = __int128;

struct Point {
    Wide x = 0, y = 0, z = 0;
};
using IntTriangle = std::array<Point, 3>;

inline Point operator-(const Point& a, const Point& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Point cross(const Point& a, const Point& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Wide dot(const Point& a, const Point& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline bool isZero(const Point& a) {
    return a.x == 0 && a.y == 0 && a.z == 0;
}
inline int sign(Wide v) {
    return v > 0 ? 1 : (v < 0 ? -1 : 0);
}

inline int orient3d(const Point& a, const Point& b, const Point& c, const Point& d) {
    return sign(dot(d - a, cross(b - a, c - a)));
}

inline bool onSegment(const Point& p, const Point& a, const Point& b) {
    return isZero(cross(b - a, p - a)) && dot(p - a, p - b) <= 0;
}

inline bool segmentsMeet(const Point& a, const Point& b, const Point& c, const Point& d) {
    if (onSegment(a, c, d) || onSegment(b, c, d) || onSegment(c, a, b) || onSegment(d, a, b)) return true;
    if (orient3d(a, b, c, d) != 0) return false;
    // In one plane, no end on the other: they meet iff each has its ends on both sides of the other's line.
    const Point n1 = cross(b - a, c - a), n2 = cross(b - a, d - a);
    const Point n3 = cross(d - c, a - c), n4 = cross(d - c, b - c);
    return dot(n1, n2) < 0 && dot(n3, n4) < 0;
}

inline bool inTriangle(const Point& p, const IntTriangle& t) {
    const Point n = cross(t[1] - t[0], t[2] - t[0]);
    if (isZero(n)) return onSegment(p, t[0], t[1]) || onSegment(p, t[1], t[2]) || onSegment(p, t[2], t[0]);
    if (dot(n, p - t[0]) != 0) return false;
    for (std::size_t i = 0; i < 3; ++i)
        if (dot(cross(t[(i + 1) % 3] - t[i], p - t[i]), n) < 0) return false;
    return true;
}

inline bool segmentMeetsTriangle(const Point& a, const Point& b, const IntTriangle& t) {
    if (inTriangle(a, t) || inTriangle(b, t)) return true;
    for (std::size_t i = 0; i < 3; ++i)
        if (segmentsMeet(a, b, t[i], t[(i + 1) % 3])) return true;
    const Point n = cross(t[1] - t[0], t[2] - t[0]);
    if (isZero(n) || sign(dot(n, a - t[0])) * sign(dot(n, b - t[0])) >= 0) return false;
    const int s0 = orient3d(a, b, t[0], t[1]), s1 = orient3d(a, b, t[1], t[2]), s2 = orient3d(a, b, t[2], t[0]);
    return (s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0);
}

/// Two triangles meet iff an edge of one meets the other.
inline bool trianglesMeet(const IntTriangle& a, const IntTriangle& b) {
    for (std::size_t i = 0; i < 3; ++i) {
        if (segmentMeetsTriangle(a[i], a[(i + 1) % 3], b)) return true;
        if (segmentMeetsTriangle(b[i], b[(i + 1) % 3], a)) return true;
    }
    return false;
}

inline Vec3d toDouble(const Point& p) {
    return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}
inline Triangle toDouble(const IntTriangle& t) {
    return {toDouble(t[0]), toDouble(t[1]), toDouble(t[2])};
}

}  // namespace tessera::oracle
