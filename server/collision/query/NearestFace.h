/// Which triangle of a body is nearest to a place?
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

struct NearestFace {
    std::uint32_t face = 0;
    Vec3d point = Vec3d::Zero();  ///< of the face, in the place's frame
    double distance = 0;
};

/// The nearest triangle that is no farther than `within`, exact to rounding; of equal distances the lowest face.
/// `map`: from the mesh's frame to the place's, any finite affine map; one that flattens costs more. Nothing for a
/// place that is not finite; nothing, too, where the work was exhausted before the nearest was certain. The same answer
/// with every kind of tree; thread-safe.
[[nodiscard]] std::optional<NearestFace> nearestFace(const TriangleTree& tree, const Affine3d& map, const Vec3d& place,
                                                     QueryWork& work,
                                                     double within = std::numeric_limits<double>::infinity());

}  // namespace tessera
