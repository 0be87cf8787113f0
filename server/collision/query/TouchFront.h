/// Touch queries of two bodies that move little from frame to frame.
///
/// What the last query found is looked at first: the pair of triangles that met, then the small parts of the trees
/// around it; only if nothing meets there, the whole trees. So bodies in contact are found in contact at once. The
/// other answer needs the whole walk as ever: a proof that nothing meets cannot be had from a part.
#pragma once

#include "server/collision/query/TouchQuery.h"
#include "server/collision/tree/KernelTypes.h"

namespace tessera {

namespace touch {
class Search;
}

/// Owned by the caller, one per pair of bodies; a value. It may be used with other trees, and after refit or rebuild:
/// what it remembers is a hint that is checked against the trees as they are, and no answer depends on it.
class TouchFront {
public:
    /// As firstTouching of TouchQuery.h. Which pair of triangles is found may differ from it, and so do the counters.
    [[nodiscard]] TouchedPair firstTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                            QueryWork& work, const TouchOptions& options = {});
    void forget() { known_ = false; }

private:
    [[nodiscard]] TouchedPair outcome(touch::Search& search, QueryWork& work);

    bool known_ = false;
    FacePair faces_;
    kernel::SlotPair around_{0, 0};
};

}  // namespace tessera
