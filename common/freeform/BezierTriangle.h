/// Bézier patches over triangles, polynomial: what Loop's subdivision surfaces are made of.
///
/// Farin, Curves and Surfaces for CAGD: Bernstein polynomials over a triangle. Values only; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/freeform/SurfacePoint.h"
#include "common/math/Box.h"

namespace tessera {

/// The corners are (u, v) = (0, 0), (1, 0) and (0, 1).
struct BezierTriangle {
    int degree = 4;
    /// (degree + 1)(degree + 2) / 2 of them, rows of equal j (towards the third corner), i (towards the second)
    /// fastest.
    std::vector<Vec3d> points;

    [[nodiscard]] static constexpr std::size_t index(int degree, int i, int j) {
        return static_cast<std::size_t>(j * (degree + 1) - j * (j - 1) / 2 + i);
    }
    [[nodiscard]] const Vec3d& at(int i, int j) const { return points[index(degree, i, j)]; }
    [[nodiscard]] Vec3d& at(int i, int j) { return points[index(degree, i, j)]; }
};

/// The surface lies in the hull of its control points, so in this box.
[[nodiscard]] Box boxOf(const BezierTriangle& triangle);

/// At u, v of 0 or more with u + v at most 1. The normal is zero where du × dv is.
[[nodiscard]] SurfacePoint evaluate(const BezierTriangle& triangle, double u, double v);

/// The part between three places of the parameter plane, which may be anywhere. Exact but for rounding.
[[nodiscard]] BezierTriangle partOf(const BezierTriangle& triangle, const std::array<Vec2d, 3>& corners);

/// At the middles of the edges: beside corner 0, 1, 2, and the middle with its corners at those of edges 1, 2, 0.
[[nodiscard]] std::array<BezierTriangle, 4> split(const BezierTriangle& triangle);

}  // namespace tessera
