/// On which side? Answered without rounding error: a floating-point filter first, exact arithmetic where the filter
/// cannot tell (Shewchuk 1997).
///
/// Exact for finite coordinates as long as products of three coordinate differences, and their rounding errors, neither
/// overflow nor underflow: magnitudes (zero apart) between 1e-60 and 1e60 are safe. Thread-safe.
#pragma once

#include <array>
#include <cmath>

#include "common/math/Types.h"

namespace tessera {

namespace exact {
[[nodiscard]] int orient2dExact(const Vec2d& a, const Vec2d& b, const Vec2d& c);
[[nodiscard]] int orient3dExact(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);
/// Half a unit in the last place of 1.
inline constexpr double kRounding = 1.1102230246251565e-16;
}  // namespace exact

/// +1 where a, b, c turn left (counter-clockwise), -1 where they turn right, 0 where they lie on one line.
[[nodiscard]] inline int orient2d(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    constexpr double kBound = (3.0 + 16.0 * exact::kRounding) * exact::kRounding;
    const double left = (a.x() - c.x()) * (b.y() - c.y());
    const double right = (a.y() - c.y()) * (b.x() - c.x());
    const double det = left - right;
    const double bound = kBound * (std::abs(left) + std::abs(right));
    if (det > bound) return 1;
    if (-det > bound) return -1;
    return exact::orient2dExact(a, b, c);
}

/// The sign of (d - a) · ((b - a) × (c - a)): +1 where d lies on the side from which a, b, c are seen
/// counter-clockwise, 0 where the four points lie in one plane.
[[nodiscard]] inline int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    constexpr double kBound = (7.0 + 56.0 * exact::kRounding) * exact::kRounding;
    const double adx = a.x() - d.x(), ady = a.y() - d.y(), adz = a.z() - d.z();
    const double bdx = b.x() - d.x(), bdy = b.y() - d.y(), bdz = b.z() - d.z();
    const double cdx = c.x() - d.x(), cdy = c.y() - d.y(), cdz = c.z() - d.z();
    const double bc1 = bdx * cdy, bc2 = cdx * bdy;
    const double ca1 = cdx * ady, ca2 = adx * cdy;
    const double ab1 = adx * bdy, ab2 = bdx * ady;
    const double det = adz * (bc1 - bc2) + bdz * (ca1 - ca2) + cdz * (ab1 - ab2);
    const double bound =
        kBound * ((std::abs(bc1) + std::abs(bc2)) * std::abs(adz) + (std::abs(ca1) + std::abs(ca2)) * std::abs(bdz) +
                  (std::abs(ab1) + std::abs(ab2)) * std::abs(cdz));
    if (det > bound) return -1;
    if (-det > bound) return 1;
    return exact::orient3dExact(a, b, c, d);
}

/// For each corner of a triangle: the side of another one's plane on which it lies.
[[nodiscard]] inline std::array<int, 3> sidesOf(const std::array<Vec3d, 3>& plane, const std::array<Vec3d, 3>& t) {
    return {orient3d(plane[0], plane[1], plane[2], t[0]), orient3d(plane[0], plane[1], plane[2], t[1]),
            orient3d(plane[0], plane[1], plane[2], t[2])};
}

/// Leaves out one coordinate; seen from its positive end, what turns left still does.
[[nodiscard]] inline Vec2d project(const Vec3d& p, int axis) {
    return {p[(axis + 1) % 3], p[(axis + 2) % 3]};
}

[[nodiscard]] inline bool lexicographicallyLess(const Vec3d& a, const Vec3d& b) {
    if (a.x() != b.x()) return a.x() < b.x();
    if (a.y() != b.y()) return a.y() < b.y();
    return a.z() < b.z();
}

}  // namespace tessera
