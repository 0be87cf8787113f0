/// What does a ray meet first?
#pragma once

#include <cstdint>
#include <optional>

#include "common/math/Ray.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

struct RayHit {
    std::uint32_t face = 0;
    double t = 0;  ///< in lengths of the ray's direction
};

/// The nearest triangle that the ray meets, seen from either side, within 0 <= t <= maxT. Of equal t the lowest face
/// (of a ray from more than 16 sizes of the mesh away: one of those that rounding makes equal). The ray is in the
/// mesh's frame and may begin as far away as doubles reach: t is right to its last digits. Nothing for a ray that is
/// not finite or has no direction. The same answer with every kind of tree; thread-safe. What it took is added to
/// `work`; where that is exhausted, nothing is found.
[[nodiscard]] std::optional<RayHit> castRay(const TriangleTree& tree, const Ray& ray, double maxT, QueryWork& work);
[[nodiscard]] inline std::optional<RayHit> castRay(const TriangleTree& tree, const Ray& ray, double maxT) {
    QueryWork any;
    return castRay(tree, ray, maxT, any);
}

}  // namespace tessera
