/// How many cells a tolerance takes at least, known before one is halved: so that what would be refused after a second
/// is refused at once.
///
/// A cell that counts as flat is off its bilinear patch by no more than half of the tolerance. Where second derivatives
/// along u are at least m, in some direction, the middle of a side of a cell of width w is off by w² m / 8 or more: so
/// w² is at most 4 · tolerance / m. Cells that lie in a rectangle fill it but for a rim that those across its border
/// reach into, by no more than the root of 8 · tolerance / m, as second differences over a part of a cell are at most
/// twice what that is off. Derivatives are bounded by Bézier coefficients (Farin, Curves and Surfaces for CAGD), of
/// rational patches with the quotient rule around a point of their own. Values only; any thread.
#pragma once

#include "common/freeform/nurbs/tessellation/ParameterLattice.h"

namespace tessera {

/// No way of halving makes fewer flat cells of the surface (of a trimmed one: but for slivers that chords of its trims
/// are off these). It is a tenth or so of what there are; 0 where curvature vanishes or changes its sign everywhere.
/// Takes some milliseconds, and beyond 4,096 spans some sums per control point of Bézier patches.
[[nodiscard]] double leastCells(const NurbsSurface& surface, const LatticeSurface& lattice, double tolerance);

}  // namespace tessera
