/// A surface in patches that are nearly flat, each with what is proven of it: what pictures and collision are made from.
///
/// Common edges of patches of different sizes are on one curve, but not cut at the same points. Pure; any thread.
#pragma once

#include <cstddef>
#include <vector>

#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

struct FlatPatch {
    BezierPatch patch;
    ParameterRectangle over;
    /// No farther than this from the two triangles of its corners (facetDeviation). Of the whole patch, the part that is trimmed away too.
    double deviation = 0;
    RectangleSide side = RectangleSide::kKept;  ///< kKept or kCrossed
};

struct FlatPatchLimits {
    std::size_t maxPatches = 1'000'000;
    int maxHalvings = 60;  ///< of one Bézier patch
};

/// Parts of the Bézier patches, halved until each one's deviation is at most `tolerance`, in the surface's units; without those that are trimmed
/// away. Refused (kLimit) where that takes more than the limits, and where the tolerance is not above 0.
[[nodiscard]] Expected<std::vector<FlatPatch>> flatPatches(const NurbsSurface& surface, double tolerance, const FlatPatchLimits& limits = {});

}  // namespace tessera
