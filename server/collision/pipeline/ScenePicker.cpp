#include "server/collision/pipeline/ScenePicker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/drawable/Drawable.h"
#include "common/math/Decompositions.h"
#include "common/scene/Action.h"
#include "server/collision/objects/SortOnce.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/query/NearestFace.h"
#include "server/collision/query/RayQuery.h"

namespace tessera {

namespace {

/// The wall's own marks of contacts, for one.
bool isLookedThrough(const Aspect& aspect, ObjectId node) {
    for (ObjectId id = node; id; id = aspect.get<Node>(id)->parent)
        if (const CollisionObject* object = aspect.coreOf<CollisionObject>(*aspect.get<Node>(id)))
            if (object->layers == 0 && object->node == id) return true;
    return false;
}

/// No point of the box is nearer, whatever rounding does. Below 0 where that may be nothing at all.
double distanceTo(const Box& box, const Vec3d& place) {
    const Vec3d beyond = (box.lower - place).cwiseMax(place - box.upper).cwiseMax(0.0);
    constexpr double kRounding = 1e-12;
    return beyond.norm() - kRounding * (box.lower.norm() + box.upper.norm() + place.norm());
}

/// Points are balls. The octahedra that stand for them have their corners on these; the middles of their faces are the
/// farthest from them. Of `face` of a mesh of octahedra.
double errorOf(const Triangle& face, const Affine3d& world) {
    const double radius = (face[1] - face[0]).norm() / std::numbers::sqrt2;
    return radius * (1 - 1 / std::numbers::sqrt3) * singularStretchOf(world.linear()).most;
}

}  // namespace

/// Empty where nothing can be hit.
Box ScenePicker::boxOf(const Aspect& aspect, const Place& place, WorldTransforms& worlds) {
    if (!place.node || place.kind != CoreKind::kDrawable) return {};
    const Affine3d world = worlds.of(place.node);
    if (!world.matrix().allFinite()) return {};
    const Box box = boxAround(world, shapes_->bounds(drawableOf(aspect, place.core).arrays()));
    return box.lower.allFinite() && box.upper.allFinite() ? box : Box{};
}

bool ScenePicker::isUnmade(const MeshArrays& arrays, PickPatience* patience) const {
    if (!patience || shapes_->isMade(arrays)) return false;
    UnmadeShape unmade = shapes_->unmade(arrays);
    if (unmade.faceCount() <= patience->maxMadeFaces) return false;
    patience->unmade = std::move(unmade);
    return true;
}

std::shared_ptr<const CollisionShape> ScenePicker::shapeOf(const MeshArrays& arrays, PickPatience* patience) {
    if (isUnmade(arrays, patience)) return nullptr;
    std::shared_ptr<const CollisionShape> shape = shapes_->shape(arrays);
    constexpr std::uint64_t kSomeTimes = 8;  // the cache goes through all that it has
    if (patience && shape && shape != recent_[0] && shapes_->unmade(arrays).faceCount() > patience->maxMadeFaces) {
        recent_[1] = std::exchange(recent_[0], shape);
        if (++changes_ % kSomeTimes == 0) (void)shapes_->forgetIdleShapes();
    }
    return shape;
}

void ScenePicker::follow(const Aspect& aspect, ObjectHandler& handler) {
    const PagedRow<Place>& places = handler.places();
    WorldTransforms worlds(aspect);
    // What stands elsewhere in the handler is laid over the scene. It may be in the scene by the next time, and the
    // handler, where nothing has moved then, does not say so.
    const auto isLaidOver = [&](std::uint32_t place) {
        return places[place].node && places[place].kind == CoreKind::kDrawable &&
               !sameBits(places[place].world, worlds.of(places[place].node));
    };
    std::vector<std::uint32_t> before = std::exchange(laidOver_, {});
    if (std::optional<std::vector<std::uint32_t>> drawn = handler.takeDrawn()) {
        drawn->insert(drawn->end(), before.begin(), before.end());
        sortOnce(*drawn);
        for (const std::uint32_t place : *drawn) {
            if (const Box box = boxOf(aspect, places[place], worlds); box.empty())
                tree_.take(place);
            else
                tree_.put(place, box);
            if (isLaidOver(place)) laidOver_.push_back(place);
        }
        return;
    }
    std::vector<PickTree::Item> items;
    for (std::uint32_t place = 0; place < places.size(); ++place) {
        if (const Box box = boxOf(aspect, places[place], worlds); !box.empty()) items.push_back({place, box});
        if (isLaidOver(place)) laidOver_.push_back(place);
    }
    tree_.build(std::move(items));
}

std::optional<PickHit> ScenePicker::pick(const Aspect& aspect, ObjectHandler& handler, const Ray& ray,
                                         PickPatience* patience) {
    follow(aspect, handler);
    QueryWork any;
    QueryWork& work = patience ? patience->work : any;
    std::optional<PickHit> best;
    std::uint32_t bestPlace = Place::kNone;
    double limit = std::numeric_limits<double>::infinity();
    const auto wanted = [&](const Box& box) { return meetsBox(box, ray, limit); };
    const auto nearness = [&](const Box& box) { return (box.center() - ray.origin).dot(ray.direction); };
    tree_.forItems(wanted, nearness, [&](std::uint32_t number) {
        if (patience && patience->unmade) return;
        const Place& place = handler.places()[number];
        if (isLookedThrough(aspect, place.node)) return;
        const Affine3d world = worldTransform(aspect, place.node);
        if (isFlattened(world)) return;
        const Affine3d local = world.inverse();
        if (!local.matrix().allFinite()) return;
        // An affine map keeps t, so distances along the ray compare between frames.
        const MeshArrays arrays = drawableOf(aspect, place.core).arrays();
        const Ray localRay{local * ray.origin, local.linear() * ray.direction};
        if (!meetsBox(shapes_->bounds(arrays), localRay, limit)) return;
        const std::shared_ptr<const CollisionShape> shape = shapeOf(arrays, patience);
        if (!shape) return;
        const std::optional<RayHit> hit = castRay(shape->tree(), localRay, limit, work);
        if (!hit || (best && (hit->t > best->t || (hit->t == best->t && !handler.precedes(number, bestPlace))))) return;
        best = PickHit{.node = place.node, .face = hit->face, .point = ray.origin + hit->t * ray.direction, .t = hit->t};
        bestPlace = number;
        limit = hit->t;
    });
    if (!best || work.exhausted() || (patience && patience->unmade)) return std::nullopt;
    const MeshArrays arrays = drawableOf(aspect, handler.places()[bestPlace].core).arrays();
    if (const std::optional<HitDetails> details = detailsOf(arrays, worldTransform(aspect, best->node), best->face, best->point)) best->details = *details;
    return best;
}

bool ScenePicker::facesIn(const Aspect& aspect, ObjectHandler& handler, const Box& box, QueryWork& work,
                          std::vector<Triangle>& faces, PickPatience* patience) {
    follow(aspect, handler);
    std::vector<std::uint32_t> near;
    const auto wanted = [&](const Box& around) {
        ++work.boxTests;
        return !work.exhausted() && around.overlaps(box);
    };
    tree_.forItems(wanted, [](const Box&) { return 0.0; }, [&](std::uint32_t number) { near.push_back(number); });
    const std::size_t before = faces.size();
    const auto giveUp = [&] {
        faces.resize(before);
        return false;
    };
    if (work.exhausted()) return giveUp();
    std::sort(near.begin(), near.end());
    std::vector<std::uint32_t> found;
    for (const std::uint32_t number : near) {
        const Place& place = handler.places()[number];
        if (isLookedThrough(aspect, place.node)) continue;
        const MeshArrays arrays = drawableOf(aspect, place.core).arrays();
        if (isUnmade(arrays, patience)) return giveUp();
        const std::shared_ptr<const CollisionShape> shape = shapes_->shape(arrays);
        if (!shape) continue;
        const Affine3d world = worldTransform(aspect, place.node);
        // What is flattened has no map back; all of it is looked at.
        Box local = shape->mesh().bounds();
        if (const Affine3d back = world.inverse(); !isFlattened(world) && back.matrix().allFinite()) local = boxAround(back, box);
        found.clear();
        if (!facesNear(shape->tree(), local, work, found)) return giveUp();
        for (const std::uint32_t face : found) {
            const Triangle triangle = transformed(world, shape->mesh().triangle(face));
            Box around;
            for (const Vec3d& corner : triangle) around.extend(corner);
            if (around.overlaps(box)) faces.push_back(triangle);
        }
    }
    return true;
}

std::optional<NearestSurface> ScenePicker::nearest(const Aspect& aspect, ObjectHandler& handler, const Vec3d& place,
                                                   ObjectId below, QueryWork& work, PickPatience* patience) {
    if (!(place.cwiseAbs().maxCoeff() <= kMostCoordinate)) return std::nullopt;
    follow(aspect, handler);
    const std::uint32_t top = handler.placeOf(below);
    if (top == Place::kNone) return std::nullopt;
    const PagedRow<Place>& places = handler.places();
    constexpr double kNothing = std::numeric_limits<double>::infinity();
    std::optional<NearestSurface> best;
    std::uint32_t bestPlace = Place::kNone;
    double limit = kMostCoordinate;
    const auto distance = [&](const Box& box) {
        ++work.boxTests;
        return work.exhausted() ? kNothing : distanceTo(box, place);
    };
    tree_.forNearest(limit, distance, [&](std::uint32_t number) {
        constexpr double kNoFurther = -1;
        if (patience && patience->unmade) return kNoFurther;
        const Place& at = places[number];
        if (!handler.holds(top, number) || isLookedThrough(aspect, at.node)) return limit;
        const MeshArrays arrays = drawableOf(aspect, at.core).arrays();
        const std::shared_ptr<const CollisionShape> shape = shapeOf(arrays, patience);
        if (!shape) return patience && patience->unmade ? kNoFurther : limit;
        const Affine3d world = worldTransform(aspect, at.node);
        const std::optional<NearestFace> found = nearestFace(shape->tree(), world, place, work, limit);
        if (!found || (best && found->distance == best->distance && !handler.precedes(number, bestPlace))) return limit;
        best = NearestSurface{
            .node = at.node,
            .face = found->face,
            .point = found->point,
            .distance = found->distance,
            .error = arrays.primitive == Primitive::kPoints ? errorOf(shape->mesh().triangle(found->face), world) : 0};
        bestPlace = number;
        return limit = found->distance;
    });
    if (!best || work.exhausted() || (patience && patience->unmade)) return std::nullopt;
    const MeshArrays arrays = drawableOf(aspect, places[bestPlace].core).arrays();
    const Affine3d world = worldTransform(aspect, best->node);
    if (const std::optional<HitDetails> details = detailsOf(arrays, world, best->face, best->point))
        best->details = *details;
    return best;
}

}  // namespace tessera
