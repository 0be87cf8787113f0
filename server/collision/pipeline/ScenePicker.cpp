#include "server/collision/pipeline/ScenePicker.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/scene/Action.h"
#include "server/collision/query/RayQuery.h"

namespace tessera {

namespace {

/// Does the ray come into the box at some 0 <= t <= maxT? Errs on the side of yes.
bool meetsBox(const Box& box, const Ray& ray, double maxT) {
    if (box.empty()) return false;
    double first = 0, last = maxT;
    for (int i = 0; i < 3; ++i) {
        const double slack = 1e-12 * (std::abs(box.lower[i]) + std::abs(box.upper[i]) + std::abs(ray.origin[i]));
        const double lower = box.lower[i] - slack - ray.origin[i], upper = box.upper[i] + slack - ray.origin[i];
        if (ray.direction[i] == 0) {
            if (lower > 0 || upper < 0) return false;
            continue;
        }
        const double t = lower / ray.direction[i], u = upper / ray.direction[i];
        first = std::max(first, std::min(t, u));
        last = std::min(last, std::max(t, u));
    }
    return first <= last * (1 + 1e-12);
}

}  // namespace

std::optional<PickHit> ScenePicker::pick(const Aspect& aspect, const Ray& ray) const {
    std::optional<PickHit> best;
    double limit = std::numeric_limits<double>::infinity();
    Action action;
    // The wall's own marks of contacts, for one.
    action.on<CollisionObject>([](const Visit& visit, const CollisionObject& object) {
        return object.layers == 0 && object.node == visit.nodeId ? Descend::kPast : Descend::kInto;
    });
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        const Affine3d& world = visit.world_T_node;
        if (!(std::abs(world.linear().determinant()) > 0)) return Descend::kInto;
        const Affine3d local = world.inverse();
        if (!local.matrix().allFinite()) return Descend::kInto;
        // An affine map keeps t, so distances along the ray compare between frames.
        const Ray localRay{local * ray.origin, local.linear() * ray.direction};
        if (!meetsBox(shapes_->bounds(geometry), localRay, limit)) return Descend::kInto;
        const std::shared_ptr<const CollisionShape> shape = shapes_->shape(geometry);
        if (!shape) return Descend::kInto;
        const std::optional<RayHit> hit = castRay(shape->tree, localRay, limit);
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
