/// Guesses for the oracle, in plain double: where two triangles are nearest, and directions that may part them. What is
/// certain is shown by others. (C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5, 5.1.9 and 5.2.)
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "common/math/Types.h"

namespace tessera::truth {

using Corners = std::array<Vec3d, 3>;

/// Of a triangle's second and third corner; neither is negative, and together they are at most 1.
struct Weights {
    double second = 0, third = 0;
    [[nodiscard]] Vec3d of(const Corners& c) const { return c[0] + second * (c[1] - c[0]) + third * (c[2] - c[0]); }
};

struct NearPoints {
    Vec3d onA = Vec3d::Zero(), onB = Vec3d::Zero();
    Weights weightsA, weightsB;
};

inline Weights nearestOn(const Corners& t, const Vec3d& p) {
    const Vec3d u = t[1] - t[0], v = t[2] - t[0], n = u.cross(v);
    const double area = n.squaredNorm();
    if (area > 0) {
        const double second = n.dot((p - t[0]).cross(v)) / area, third = n.dot(u.cross(p - t[0])) / area;
        if (second >= 0 && third >= 0 && second + third <= 1) return {second, third};
    }
    Weights best;
    double least = std::numeric_limits<double>::infinity();
    const auto along = [&](const Vec3d& from, const Vec3d& to, auto&& weights) {
        const Vec3d e = to - from;
        const double length = e.squaredNorm();
        const double s = length > 0 ? std::clamp((p - from).dot(e) / length, 0.0, 1.0) : 0;
        const double off = (from + s * e - p).squaredNorm();
        if (off < least) least = off, best = weights(s);
    };
    along(t[0], t[1], [](double s) { return Weights{s, 0}; });
    along(t[0], t[2], [](double s) { return Weights{0, s}; });
    along(t[1], t[2], [](double s) { return Weights{1 - s, s}; });
    return best;
}

/// Of two segments: how far along each.
inline std::array<double, 2> nearestAlong(const Vec3d& p, const Vec3d& d, const Vec3d& q, const Vec3d& e) {
    const Vec3d r = p - q;
    const double a = d.squaredNorm(), b = d.dot(e), c = d.dot(r), f = e.dot(r), g = e.squaredNorm();
    const auto within = [](double x) { return std::clamp(x, 0.0, 1.0); };
    if (!(a > 0)) return {0, g > 0 ? within(f / g) : 0};
    if (!(g > 0)) return {within(-c / a), 0};
    const double square = a * g - b * b;
    double s = square > 0 ? within((b * f - c * g) / square) : 0;
    double t = (b * s + f) / g;
    if (t < 0 || t > 1) {
        t = within(t);
        s = within((b * t - c) / a);
    }
    return {s, t};
}

inline NearPoints nearPoints(const Corners& a, const Corners& b) {
    NearPoints best;
    double least = std::numeric_limits<double>::infinity();
    const auto offer = [&](const Weights& wa, const Weights& wb) {
        const Vec3d x = wa.of(a), y = wb.of(b);
        const double off = (y - x).squaredNorm();
        if (off < least) least = off, best = {x, y, wa, wb};
    };
    constexpr std::array<Weights, 3> kCorner{Weights{0, 0}, Weights{1, 0}, Weights{0, 1}};
    for (std::size_t i = 0; i < 3; ++i) {
        offer(nearestOn(a, b[i]), kCorner[i]);
        offer(kCorner[i], nearestOn(b, a[i]));
    }
    const auto onEdge = [&](std::size_t i, double s) {
        const Weights &from = kCorner[i], &to = kCorner[(i + 1) % 3];
        if (i == 1) return Weights{1 - s, s};
        return Weights{from.second + s * (to.second - from.second), from.third + s * (to.third - from.third)};
    };
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const auto [s, t] = nearestAlong(a[i], a[(i + 1) % 3] - a[i], b[j], b[(j + 1) % 3] - b[j]);
            offer(onEdge(i, s), onEdge(j, t));
        }
    return best;
}

/// Normals of both, across each two edges, and in each plane square to its edges.
inline std::vector<Vec3d> separatingDirections(const Corners& a, const Corners& b) {
    std::vector<Vec3d> out;
    const Vec3d na = (a[1] - a[0]).cross(a[2] - a[0]), nb = (b[1] - b[0]).cross(b[2] - b[0]);
    out.push_back(na);
    out.push_back(nb);
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d e = a[(i + 1) % 3] - a[i];
        for (std::size_t j = 0; j < 3; ++j) out.push_back(e.cross(b[(j + 1) % 3] - b[j]));
        out.push_back(na.cross(e));
        out.push_back(nb.cross(b[(i + 1) % 3] - b[i]));
    }
    return out;
}

}  // namespace tessera::truth
