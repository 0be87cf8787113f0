/// How far triangles are from a place, in long double. Each candidate is a point of the triangle, however thin that is:
/// the nearest of each edge, and the foot of the plumb line where that is inside.
#pragma once

#include <algorithm>
#include <limits>

#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera::nearest {

using Vec3ld = Eigen::Matrix<long double, 3, 1>;

inline long double distanceToSegment(const Vec3ld& a, const Vec3ld& b, const Vec3ld& p) {
    const Vec3ld along = b - a;
    const long double square = along.dot(along);
    const long double t = square > 0 ? std::clamp(along.dot(p - a) / square, 0.0L, 1.0L) : 0.0L;
    return (a + t * along - p).norm();
}

inline long double distanceTo(const Triangle& triangle, const Vec3d& place) {
    const Vec3ld p = place.cast<long double>();
    const Vec3ld t[3] = {triangle[0].cast<long double>(), triangle[1].cast<long double>(),
                         triangle[2].cast<long double>()};
    long double least = std::numeric_limits<long double>::infinity();
    for (int i = 0; i < 3; ++i) least = std::min(least, distanceToSegment(t[i], t[(i + 1) % 3], p));
    const Vec3ld ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
    const long double square = ab.dot(ab);
    if (!(square > 0)) return least;
    const Vec3ld across = ac - ac.dot(ab) / square * ab;
    if (!(across.dot(across) > 0)) return least;
    const long double w = ap.dot(across) / across.dot(across), v = (ap.dot(ab) - w * ac.dot(ab)) / square;
    if (!(v >= 0 && w >= 0 && v + w <= 1)) return least;
    return std::min(least, Vec3ld(t[0] + v * ab + w * ac - p).norm());
}

}  // namespace tessera::nearest
