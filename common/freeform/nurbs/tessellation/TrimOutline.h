/// A surface's trims as polylines on the lattice, near enough to the curves that the surface shows no difference, and
/// never across each other.
///
/// Values only; any thread.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/nurbs/tessellation/ParameterLattice.h"

namespace tessera {

struct TrimOutline {
    /// Closed; kept is what lies on the left. No two of them cross, but they may share vertices.
    std::vector<std::vector<LatticePoint>> loops;
    bool keepsOutside = true;  ///< what is kept where no loop goes around

    /// Of a place on no loop.
    [[nodiscard]] bool keeps(const LatticePoint& p) const;
};

/// Each piece of a curve and its chord are so near that the surface between them is nowhere farther than `tolerance`
/// from the chord's points. Refused by name: loops that cross each other or themselves, or run along each other; a loop
/// that leaves the domain by more than 1e-5 of its size (nearer it is moved to the edge). Loops that cross by less than
/// the tolerance may pass as some that do not. kLimit beyond `maxPieces`.
[[nodiscard]] Expected<TrimOutline> outlineOf(const NurbsSurface& surface, const LatticeSurface& lattice,
                                              double tolerance, std::size_t maxPieces);

}  // namespace tessera
