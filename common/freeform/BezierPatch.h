/// Tensor-product Bézier patches, rational or not: what subdivision surfaces and NURBS are made of between their knots.
///
/// Farin, Curves and Surfaces for CAGD: de Casteljau, homogeneous coordinates. Values only; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/freeform/SurfacePoint.h"
#include "common/math/Box.h"

namespace tessera {

struct BezierPatch {
    int degreeU = 3, degreeV = 3;
    /// (w·x, w·y, w·z, w) with w above 0, u fastest: (degreeU + 1) · (degreeV + 1) of them. w = 1 everywhere: a
    /// polynomial patch.
    std::vector<Vec4d> points;

    [[nodiscard]] const Vec4d& at(int i, int j) const {
        return points[static_cast<std::size_t>(j) * static_cast<std::size_t>(degreeU + 1) +
                      static_cast<std::size_t>(i)];
    }
    [[nodiscard]] Vec4d& at(int i, int j) {
        return points[static_cast<std::size_t>(j) * static_cast<std::size_t>(degreeU + 1) +
                      static_cast<std::size_t>(i)];
    }
};

/// The surface lies in the hull of its control points, so in this box.
[[nodiscard]] Box boxOf(const BezierPatch& patch);

/// At (u, v) in [0, 1]². Where du × dv vanishes (an edge collapsed to a pole) the normal is what it tends to, inwards
/// along the patch.
[[nodiscard]] SurfacePoint evaluate(const BezierPatch& patch, double u, double v);

enum class PatchAxis { kU, kV };
/// The two parts below and above `t`, each with parameters 0 to 1 of its own. Exact but for rounding.
[[nodiscard]] std::array<BezierPatch, 2> split(const BezierPatch& patch, PatchAxis axis, double t = 0.5);

}  // namespace tessera
