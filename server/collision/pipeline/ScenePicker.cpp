#include "server/collision/pipeline/ScenePicker.h"

#include <cmath>
#include <limits>

#include "common/scene/Action.h"
#include "server/collision/mesh/TreeQueries.h"

namespace tessera {

std::optional<PickHit> ScenePicker::pick(const Aspect& aspect, const Ray& ray) const {
    std::optional<PickHit> best;
    double limit = std::numeric_limits<double>::infinity();
    Action action;
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        const Affine3d& world = visit.world_T_node;
        if (!(std::abs(world.linear().determinant()) > 0)) return Descend::kInto;
        const Affine3d local = world.inverse();
        if (!local.matrix().allFinite()) return Descend::kInto;
        // An affine map keeps t, so distances along the ray compare between frames.
        const Ray localRay{local * ray.origin, local.linear() * ray.direction};
        if (!meetsBox(shapes_->bounds(geometry), localRay, limit)) return Descend::kInto;
        const std::shared_ptr<const AabbTree> shape = shapes_->shape(geometry);
        if (!shape) return Descend::kInto;
        const auto hit = shape->castRay(localRay, limit);
        if (hit && (!best || hit->t < best->t)) {
            best = PickHit{visit.nodeId, hit->face, ray.origin + hit->t * ray.direction, hit->t};
            limit = hit->t;
        }
        return Descend::kInto;
    });
    action.run(aspect);
    return best;
}

}  // namespace tessera
