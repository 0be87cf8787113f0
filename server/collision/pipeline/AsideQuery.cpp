#include "server/collision/pipeline/AsideQuery.h"

#include <chrono>
#include <limits>

#include "common/rays/PickTree.h"
#include "server/collision/query/NearestFace.h"
#include "server/collision/query/RayQuery.h"

namespace tessera {
namespace {

constexpr std::uint64_t kMostWork = 500'000'000;
constexpr std::chrono::seconds kLongest{30};

}  // namespace

/// Others wait for the thread.
class AsideQuery::Budget {
public:
    explicit Budget(const std::atomic<bool>* stop) : stop_(stop) {}
    /// Asked before each thing that may take long.
    [[nodiscard]] bool goesOn() {
        over_ = over_ || work.exhausted() || (stop_ && *stop_) || Clock::now() >= until_;
        return !over_;
    }
    /// At the end: what was found counts, however long the last thing took.
    [[nodiscard]] bool over() const { return over_ || work.exhausted(); }

    QueryWork work{.limit = kMostWork};

private:
    using Clock = std::chrono::steady_clock;
    const std::atomic<bool>* stop_;
    const Clock::time_point until_ = Clock::now() + kLongest;
    bool over_ = false;
};

std::shared_ptr<const CollisionShape> AsideQuery::shapeOf(const Thing& thing) {
    if (thing.made) return thing.geometry.shape;
    if (cache_.isMade(thing.geometry.arrays)) return cache_.shape(thing.geometry.arrays);
    std::shared_ptr<const CollisionShape> shape = ShapeCache::make(thing.geometry);
    cache_.put(thing.geometry, shape);
    made.push_back({thing.geometry, shape});
    return shape;
}

void AsideQuery::forget() {
    cache_ = ShapeCache();
}

void AsidePick::answer(const std::atomic<bool>* stop) {
    Budget budget(stop);
    std::optional<PickHit> best;
    const Thing* of = nullptr;
    double limit = std::numeric_limits<double>::infinity();
    for (const Thing& thing : things) {
        if (!meetsBox(thing.box, ray_, limit)) continue;
        if (!budget.goesOn()) break;
        const Affine3d local = thing.world.inverse();
        const std::shared_ptr<const CollisionShape> shape = shapeOf(thing);
        if (!shape) continue;
        // An affine map keeps t, so distances along the ray compare between frames.
        const Ray localRay{local * ray_.origin, local.linear() * ray_.direction};
        const std::optional<RayHit> hit = castRay(shape->tree(), localRay, limit, budget.work);
        if (!hit || (best && (hit->t > best->t || (hit->t == best->t && of->rank < thing.rank)))) continue;
        best =
            PickHit{.node = thing.node, .face = hit->face, .point = ray_.origin + hit->t * ray_.direction, .t = hit->t};
        of = &thing;
        limit = hit->t;
    }
    exhausted = budget.over();
    forget();
    if (!best || exhausted) return;
    if (const auto details = detailsOf(of->geometry.arrays, of->world, best->face, best->point))
        best->details = *details;
    found = best;
}

void AsideNearest::answer(const std::atomic<bool>* stop) {
    Budget budget(stop);
    std::optional<NearestSurface> best;
    const Thing* of = nullptr;
    bool nothing = false;  // comes of some
    double limit = within;
    for (const Thing& thing : things) {
        if (!(nearestOf(thing.box, place_) <= limit)) continue;
        if (!budget.goesOn()) break;
        const std::shared_ptr<const CollisionShape> shape = shapeOf(thing);
        nothing = nothing || !shape;
        if (!shape) continue;
        const std::optional<NearestFace> near = nearestFace(shape->tree(), thing.world, place_, budget.work, limit);
        if (!near || (best && near->distance == best->distance && of->rank < thing.rank)) continue;
        best = NearestSurface{.node = thing.node,
                              .face = near->face,
                              .point = near->point,
                              .distance = near->distance,
                              .error = errorOf(thing.geometry.arrays, *shape, near->face, thing.world)};
        of = &thing;
        limit = near->distance;
    }
    exhausted = budget.over();
    forget();
    again = !best && nothing && !exhausted;
    if (!best || exhausted) return;
    if (const auto details = detailsOf(of->geometry.arrays, of->world, best->face, best->point))
        best->details = *details;
    found = best;
}

}  // namespace tessera
