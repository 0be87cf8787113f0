/// What surely holds for all of a Bézier patch, from its control points alone: how far it is from flat facets, where its normals point.
///
/// Bernstein coefficients of products and differences of patches (Farin, Curves and Surfaces for CAGD), whose hulls hold what they are the
/// coefficients of. All bounds are true of rational patches too, up to rounding (1e-14 of the coordinates). Values only; any thread.
#pragma once

#include <array>
#include <optional>

#include "common/freeform/BezierPatch.h"

namespace tessera {

/// At every (u, v) the patch is no farther than this from the bilinear patch through its four corners, at the same (u, v).
[[nodiscard]] double bilinearDeviation(const BezierPatch& patch);

/// At every (u, v) the patch is no farther than this from the two triangles (0,0) (1,0) (1,1) and (0,0) (1,1) (0,1) of its corners, at the
/// same (u, v): so each is within it of the other.
[[nodiscard]] double facetDeviation(const BezierPatch& patch);

/// The axis along which rows of control points are farther from even chords: halving it there brings a facet nearer.
[[nodiscard]] PatchAxis lessFlatAxis(const BezierPatch& patch);

struct NormalCone {
    Vec3d axis = Vec3d::UnitZ();
    double halfAngle = 0;  ///< below π/2
};
/// Every normal of the patch (du × dv, where it is more than rounding) is within the half angle of the axis. Nothing where no such cone is
/// found: the patch turns too far, folds over, or is a point or a line. A surface with a cone, whose edge does not cross itself seen along
/// the axis, does not cross itself (Volino and Magnenat-Thalmann 1994).
[[nodiscard]] std::optional<NormalCone> normalCone(const BezierPatch& patch);

}  // namespace tessera
