/// Which triangles of two deforming bodies meet?
///
/// Answers are those of TouchQuery.h on trees of the same vertices, to the bit: every yes and no is
/// trianglesIntersect's. B's groups are mapped into A's frame, first by their boxes, those that are left vertex by
/// vertex; pairs of groups whose boxes overlap are looked at deepest first, and within them only triangles that reach
/// into both boxes.
#pragma once

#include <memory>

#include "common/math/Types.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/spherical_bezier/DeformingSurface.h"

namespace tessera {

/// What a query makes on its way, kept so that the next one need not ask for memory. One per thread.
class DeformingTouch {
public:
    DeformingTouch();
    ~DeformingTouch();
    DeformingTouch(DeformingTouch&&) noexcept;
    DeformingTouch& operator=(DeformingTouch&&) noexcept;

    /// `a_T_b`: any finite affine map from B's frame to A's. kUnknown: the work was exhausted before anything was
    /// found.
    [[nodiscard]] TouchedPair first(const DeformingSurface& a, const DeformingSurface& b, const Affine3d& a_T_b,
                                    QueryWork& work);
    /// Every pair, ascending.
    [[nodiscard]] FacePairs all(const DeformingSurface& a, const DeformingSurface& b, const Affine3d& a_T_b,
                                QueryWork& work);

private:
    struct Walk;
    std::unique_ptr<Walk> walk_;
};

}  // namespace tessera
