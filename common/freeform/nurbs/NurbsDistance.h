/// The point of a trimmed surface that is nearest to a place.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/freeform/PatchDistance.h"
#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

/// A surface made ready for many questions. Immutable: any thread.
class NurbsDistance {
public:
    explicit NurbsDistance(const NurbsSurface& surface);

    /// (u, v) of the surface. `error` holds for what trimming leaves; on a trimming curve it is as small as asked for
    /// only after more parts than inside, for the bound is off by the part's size there. Nothing where trimming leaves
    /// nothing that was found.
    [[nodiscard]] std::optional<ClosestPoint> closestPoint(const Vec3d& place, double tolerance,
                                                           std::size_t maxParts = 20'000) const;

private:
    NurbsSurface surface_;
    std::vector<BezierPatch> patches_;
    std::vector<ParameterRectangle> over_;
};

}  // namespace tessera
