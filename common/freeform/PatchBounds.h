/// What surely holds for all of a Bézier patch, from its control points alone: how far it is from flat.
///
/// Bernstein coefficients of products and differences of patches (Farin, Curves and Surfaces for CAGD), whose hulls
/// hold what they are the coefficients of. All bounds are true of rational patches too, up to rounding (1e-14 of the
/// coordinates). Values only; any thread.
#pragma once

#include "common/freeform/BezierPatch.h"

namespace tessera {

/// At every (u, v) the patch is no farther than this from the bilinear patch through its four corners, at the same (u,
/// v).
[[nodiscard]] double bilinearDeviation(const BezierPatch& patch);

/// The axis along which rows of control points are farther from even chords: halving it there brings a facet nearer.
[[nodiscard]] PatchAxis lessFlatAxis(const BezierPatch& patch);

}  // namespace tessera
