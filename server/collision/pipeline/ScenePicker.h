/// What does a ray hit first?
#pragma once

#include <memory>
#include <optional>

#include "common/math/Ray.h"
#include "common/scene/Aspect.h"
#include "server/collision/objects/ShapeCache.h"

namespace tessera {

struct PickHit {
    ObjectId node;                ///< the node that bears the geometry
    std::uint32_t face = 0;       ///< triangle index in the geometry
    Vec3d point = Vec3d::Zero();  ///< world
    double t = 0;                 ///< in lengths of the ray's direction
};

/// Looks at every visible geometry, from either side, but for what is below a CollisionObject of layers 0 that stands
/// at the very node it names. Costs a walk over the scene's nodes; trees are built only for what the ray comes near.
/// Not thread-safe.
class ScenePicker {
public:
    explicit ScenePicker(std::shared_ptr<ShapeCache> shapes) : shapes_(std::move(shapes)) {}

    /// Of equal distances the first node in document order. Geometry that is absent or malformed is not hit.
    [[nodiscard]] std::optional<PickHit> pick(const Aspect& aspect, const Ray& ray) const;

private:
    std::shared_ptr<ShapeCache> shapes_;
};

}  // namespace tessera
