#include "server/collision/pipeline/ScenePicker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/collision/objects/SortOnce.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/query/NearestFace.h"
#include "server/collision/query/RayQuery.h"

namespace tessera {

namespace {

/// What is above things, each looked at once for all of them.
class Above {
public:
    explicit Above(const Aspect& aspect) : aspect_(aspect), worlds_(aspect) {}

    /// The wall's own marks of contacts are, for one. What that takes counts.
    [[nodiscard]] bool isLookedThrough(ObjectId node, QueryWork& work) {
        const std::size_t begin = way_.size();
        bool through = false;
        for (ObjectId id = node; id; id = aspect_.get<Node>(id)->parent) {
            ++work.boxTests;
            if (const auto known = through_.find(id); known != through_.end()) {
                through = known->second;
                break;
            }
            way_.push_back(id);
            const CollisionObject* object = aspect_.coreOf<CollisionObject>(*aspect_.get<Node>(id));
            if (object && object->layers == 0 && object->node == id) {
                through = true;
                break;
            }
        }
        for (; way_.size() > begin; way_.pop_back()) through_.emplace(way_.back(), through);
        return through;
    }
    [[nodiscard]] Affine3d world(ObjectId node) { return worlds_.of(node); }

private:
    const Aspect& aspect_;
    WorldTransforms worlds_;
    std::unordered_map<ObjectId, bool> through_;
    std::vector<ObjectId> way_;
};

/// Where it stands, what it is of: as much as so many boxes of a tree.
constexpr std::uint64_t kLookAtThing = 8;
/// That may be looked at to put a question together.
constexpr std::uint64_t kMostBoxes = 16 * AsideQuery::kMostThings;

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
    if (const std::size_t faces = unmade.faceCount(); faces <= patience->maxMadeFaces) {
        patience->maxMadeFaces -= faces;
        return false;
    }
    patience->unmade = std::move(unmade);
    return true;
}

std::shared_ptr<const CollisionShape> ScenePicker::shapeOf(const MeshArrays& arrays, PickPatience* patience) {
    if (isUnmade(arrays, patience)) return nullptr;
    const bool isNew = !shapes_->isMade(arrays);
    std::shared_ptr<const CollisionShape> shape = shapes_->shape(arrays);
    if (isNew) kept_.add(arrays, shape);
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

template <typename Over, typename Visit>
void ScenePicker::along(const Aspect& aspect, ObjectHandler& handler, const Ray& ray, const double& limit,
                        QueryWork& work, const Over& over, const Visit& visit) const {
    Above above(aspect);
    const auto met = [&](const Box& box) {
        ++work.boxTests;
        return !over() && meetsBox(box, ray, limit);
    };
    const auto nearness = [&](const Box& box) { return (box.center() - ray.origin).dot(ray.direction); };
    tree_.forItems(met, nearness, [&](std::uint32_t number) {
        work.boxTests += kLookAtThing;
        const Place& place = handler.places()[number];
        if (above.isLookedThrough(place.node, work)) return;
        const Affine3d world = above.world(place.node);
        if (isFlattened(world)) return;
        const Affine3d local = world.inverse();
        if (local.matrix().allFinite()) visit(number, drawableOf(aspect, place.core).arrays(), world, local);
    });
}

std::optional<PickHit> ScenePicker::pick(const Aspect& aspect, ObjectHandler& handler, const Ray& ray,
                                         PickPatience* patience) {
    follow(aspect, handler);
    QueryWork any;
    QueryWork& work = patience ? patience->work : any;
    std::optional<PickHit> best;
    std::uint32_t bestPlace = Place::kNone;
    double limit = std::numeric_limits<double>::infinity();
    const auto over = [&] { return work.exhausted() || (patience && patience->unmade); };
    const auto look = [&](std::uint32_t number, const MeshArrays& arrays, const Affine3d&, const Affine3d& local) {
        // An affine map keeps t, so distances along the ray compare between frames.
        const Ray localRay{local * ray.origin, local.linear() * ray.direction};
        if (!meetsBox(shapes_->bounds(arrays), localRay, limit)) return;
        const std::shared_ptr<const CollisionShape> shape = shapeOf(arrays, patience);
        if (!shape) return;
        const std::optional<RayHit> hit = castRay(shape->tree(), localRay, limit, work);
        if (!hit || (best && (hit->t > best->t || (hit->t == best->t && !handler.precedes(number, bestPlace))))) return;
        best = PickHit{.node = handler.places()[number].node,
                       .face = hit->face,
                       .point = ray.origin + hit->t * ray.direction,
                       .t = hit->t};
        bestPlace = number;
        limit = hit->t;
    };
    along(aspect, handler, ray, limit, work, over, look);
    if (!best || over()) return std::nullopt;
    const MeshArrays arrays = drawableOf(aspect, handler.places()[bestPlace].core).arrays();
    kept_.used(shapes_->unmade(arrays).shape);
    if (!patience) (void)kept_.takeReleased();
    if (const std::optional<HitDetails> details =
            detailsOf(arrays, worldTransform(aspect, best->node), best->face, best->point))
        best->details = *details;
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
    tree_.forItems(
        wanted, [](const Box&) { return 0.0; }, [&](std::uint32_t number) { near.push_back(number); });
    const std::size_t before = faces.size();
    const auto giveUp = [&] {
        faces.resize(before);
        return false;
    };
    if (work.exhausted()) return giveUp();
    std::sort(near.begin(), near.end());
    std::vector<std::uint32_t> found;
    Above above(aspect);
    for (const std::uint32_t number : near) {
        const Place& place = handler.places()[number];
        if (above.isLookedThrough(place.node, work)) continue;
        const MeshArrays arrays = drawableOf(aspect, place.core).arrays();
        if (isUnmade(arrays, patience)) return giveUp();
        const std::shared_ptr<const CollisionShape> shape = shapes_->shape(arrays);
        if (!shape) continue;
        const Affine3d world = above.world(place.node);
        // What is flattened has no map back; all of it is looked at.
        Box local = shape->mesh().bounds();
        if (const Affine3d back = world.inverse(); !isFlattened(world) && back.matrix().allFinite())
            local = boxAround(back, box);
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
                                                   ObjectId below, PickPatience* patience) {
    if (!(place.cwiseAbs().maxCoeff() <= kMostCoordinate)) return std::nullopt;
    follow(aspect, handler);
    const std::uint32_t top = handler.placeOf(below);
    if (top == Place::kNone) return std::nullopt;
    const PagedRow<Place>& places = handler.places();
    QueryWork any;
    QueryWork& work = patience ? patience->work : any;
    Above above(aspect);
    constexpr double kNothing = std::numeric_limits<double>::infinity();
    std::optional<NearestSurface> best;
    std::uint32_t bestPlace = Place::kNone;
    double limit = kMostCoordinate;
    const auto distance = [&](const Box& box) {
        ++work.boxTests;
        return work.exhausted() ? kNothing : nearestOf(box, place);
    };
    tree_.forNearest(limit, distance, [&](std::uint32_t number) {
        constexpr double kNoFurther = -1;
        if (work.exhausted() || (patience && patience->unmade)) return kNoFurther;
        work.boxTests += kLookAtThing;
        const Place& at = places[number];
        if (!handler.holds(top, number) || above.isLookedThrough(at.node, work)) return limit;
        const MeshArrays arrays = drawableOf(aspect, at.core).arrays();
        const std::shared_ptr<const CollisionShape> shape = shapeOf(arrays, patience);
        if (!shape) return patience && patience->unmade ? kNoFurther : limit;
        const Affine3d world = above.world(at.node);
        const std::optional<NearestFace> found = nearestFace(shape->tree(), world, place, work, limit);
        if (!found || (best && found->distance == best->distance && !handler.precedes(number, bestPlace))) return limit;
        best = NearestSurface{.node = at.node,
                              .face = found->face,
                              .point = found->point,
                              .distance = found->distance,
                              .error = errorOf(arrays, *shape, found->face, world)};
        bestPlace = number;
        return limit = found->distance;
    });
    if (!best || work.exhausted() || (patience && patience->unmade)) return std::nullopt;
    const MeshArrays arrays = drawableOf(aspect, places[bestPlace].core).arrays();
    kept_.used(shapes_->unmade(arrays).shape);
    if (!patience) (void)kept_.takeReleased();
    const Affine3d world = worldTransform(aspect, best->node);
    if (const std::optional<HitDetails> details = detailsOf(arrays, world, best->face, best->point))
        best->details = *details;
    return best;
}

AsideQuery::Thing ScenePicker::thingAt(const ObjectHandler& handler, std::uint32_t number, const MeshArrays& arrays,
                                       const Affine3d& world) {
    AsideQuery::Thing thing{.node = handler.places()[number].node,
                            .rank = handler.rankOf(number),
                            .box = boxAround(world, shapes_->bounds(arrays)),
                            .world = world,
                            .geometry = shapes_->unmade(arrays),
                            .made = shapes_->isMade(arrays)};
    return thing;
}

std::optional<AsidePick> ScenePicker::pickAside(const Aspect& aspect, ObjectHandler& handler, const Ray& ray) {
    follow(aspect, handler);
    QueryWork work{.limit = kMostBoxes};
    AsidePick question(ray);
    constexpr double kToTheEnd = std::numeric_limits<double>::infinity();
    const auto over = [&] { return work.exhausted() || question.things.size() > AsideQuery::kMostThings; };
    const auto take = [&](std::uint32_t number, const MeshArrays& arrays, const Affine3d& world, const Affine3d&) {
        question.things.push_back(thingAt(handler, number, arrays, world));
    };
    along(aspect, handler, ray, kToTheEnd, work, over, take);
    if (over()) return std::nullopt;
    return question;
}

std::optional<AsideNearest> ScenePicker::nearestAside(const Aspect& aspect, ObjectHandler& handler, const Vec3d& place,
                                                      ObjectId below) {
    follow(aspect, handler);
    AsideNearest question(place);
    const std::uint32_t top = handler.placeOf(below);
    if (top == Place::kNone || !(place.cwiseAbs().maxCoeff() <= kMostCoordinate)) return question;
    QueryWork work{.limit = kMostBoxes};
    Above above(aspect);
    question.within = kMostCoordinate;
    const auto distance = [&](const Box& box) {
        ++work.boxTests;
        return work.exhausted() ? std::numeric_limits<double>::infinity() : nearestOf(box, place);
    };
    tree_.forNearest(question.within, distance, [&](std::uint32_t number) {
        work.boxTests += kLookAtThing;
        const Place& at = handler.places()[number];
        if (!handler.holds(top, number) || above.isLookedThrough(at.node, work)) return question.within;
        const MeshArrays arrays = drawableOf(aspect, at.core).arrays();
        if (shapes_->isMade(arrays) && !shapes_->shape(arrays)) return question.within;  // nothing comes of it
        question.things.push_back(thingAt(handler, number, arrays, above.world(at.node)));
        // All of its surface lies in its box.
        return question.within = std::min(question.within, farthestOf(question.things.back().box, place));
    });
    if (work.exhausted() || question.things.size() > AsideQuery::kMostThings) return std::nullopt;
    return question;
}

void ScenePicker::put(std::vector<MadeShape> made) {
    for (MadeShape& one : made) {
        shapes_->put(one.of, one.shape);
        // Another one may have come first.
        if (shapes_->unmade(one.of.arrays).shape == one.shape) kept_.add(one.of.arrays, std::move(one.shape));
        one = {};
    }
}

}  // namespace tessera
