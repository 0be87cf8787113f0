#include "server/collision/pipeline/CollisionPipeline.h"

#include <algorithm>
#include <array>
#include <bit>
#include <deque>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/pipeline/ContactMemory.h"
#include "server/collision/pipeline/ObjectHandler.h"
#include "server/collision/pipeline/Response.h"

namespace tessera {

namespace {

/// A wish that can be granted, and the way it asks for.
struct Mover {
    TentativeTransform wish;
    Way way;
};

using ObjectPair = std::pair<ObjectId, ObjectId>;
using PartPair = std::pair<std::uint32_t, std::uint32_t>;  // side A first

Pose valueOf(const TentativeTransform& t) {
    return {t.translation, t.rotation, t.scale};
}
Pose valueOf(const Transform& t) {
    return {t.translation, t.rotation, t.scale};
}

TentativeTransform withValue(TentativeTransform t, const Pose& value) {
    t.translation = value.translation;
    t.rotation = value.rotation;
    t.scale = value.scale;
    return t;
}

std::array<double, 10> numbersOf(const TentativeTransform& t) {
    return {t.translation.x(), t.translation.y(), t.translation.z(), t.rotation.w(), t.rotation.x(),
            t.rotation.y(),    t.rotation.z(),    t.scale.x(),       t.scale.y(),    t.scale.z()};
}

/// Whose wish counts, whatever order they come in: the lowest source; of one source the one that the numbers put first.
bool before(const TentativeTransform& x, const TentativeTransform& y) {
    if (x.transform != y.transform) return x.transform < y.transform;
    if (x.source != y.source) return x.source < y.source;
    const std::array<double, 10> nx = numbersOf(x), ny = numbersOf(y);
    return std::lexicographical_compare(nx.begin(), nx.end(), ny.begin(), ny.end(), [](double a, double b) {
        return std::bit_cast<std::uint64_t>(a) < std::bit_cast<std::uint64_t>(b);
    });
}

/// Two parts that touch: which faces, and in which poses.
struct Touching {
    ObjectPair objects;
    std::uint32_t partA, partB;
    const std::vector<FacePair>* faces;
    Affine3d worldA, worldB;
};

/// A scale on its way through zero would flatten the part.
bool turnsInsideOut(const Way& way) {
    return (way.start.scale.array() * way.end.scale.array() < 0).any();
}

}  // namespace

struct CollisionPipeline::Impl {
    explicit Impl(CollisionLimits l)
        : limits(l), shapes(std::make_shared<ShapeCache>()), handler(shapes, l.maxInterests), picker(shapes) {}

    CollisionLimits limits;
    std::shared_ptr<ShapeCache> shapes;
    ObjectHandler handler;
    std::unique_ptr<NeighbourFinder> neighbours = makeNeighbourFinder();
    StopResponse stop;
    ContactMemory memory;
    ScenePicker picker;
    std::uint64_t generation = 0;           // of the handler's tables that `neighbours` and `memory` know
    std::vector<std::uint32_t> swept;       // parts whose boxes in `neighbours` are larger than they are now
    std::vector<ObjectPair> touchedBefore;  // ascending

    // State of one step.
    struct Step {
        StepResult result;
        QueryWork work;
        std::vector<NeighbourPair> near;
        std::vector<Touching> touching;
        std::deque<Hit> hits;  // keeps what `touching` points to
    };

    StepResult run(const Aspect& committed, std::span<const TentativeTransform> wanted);
    std::vector<Mover> admit(const Aspect& committed, std::span<const TentativeTransform> wanted,
                             StepResult& result) const;
    [[nodiscard]] bool canBeShown(const Mover& mover) const;
    void findNeighbours(std::span<const Mover> movers, Step& step);
    void move(const Mover& mover, Step& step);
    [[nodiscard]] std::vector<PartPair> pairsOf(const Mover& mover, const Step& step) const;
    void touch(std::uint32_t partA, std::uint32_t partB, const std::vector<FacePair>& faces, const Affine3d& worldA,
               const Affine3d& worldB, Step& step) const;
    [[nodiscard]] Contact contactAt(const Touching& touching, const FacePair& faces) const;
    void touchAtRest(Step& step);
    void listContacts(Step& step);
    void finish(Step& step);

    [[nodiscard]] PartPair ordered(const NeighbourPair& pair) const {
        return handler.relation(pair.a, pair.b).firstIsObject ? PartPair(pair.a, pair.b) : PartPair(pair.b, pair.a);
    }
    [[nodiscard]] bool moves(const Mover& mover) const {
        for (const std::uint32_t place : handler.placesOf(mover.wish.transform)) {
            const auto [first, last] = handler.partsBelow(place);
            if (first != last) return true;
        }
        return false;
    }
};

StepResult CollisionPipeline::Impl::run(const Aspect& committed, std::span<const TentativeTransform> wanted) {
    Step step;
    step.work.limit = limits.maxTests;
    handler.dropOverlay(committed);
    const std::vector<Mover> movers = admit(committed, wanted, step.result);
    findNeighbours(movers, step);
    for (const Mover& mover : movers) move(mover, step);
    touchAtRest(step);
    finish(step);
    return std::move(step.result);
}

/// Sorts the wishes, refuses impossible ones, grants those that move no part of any interest, and returns the others.
std::vector<Mover> CollisionPipeline::Impl::admit(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                                  StepResult& result) const {
    std::vector<TentativeTransform> wishes(wanted.begin(), wanted.end());
    std::sort(wishes.begin(), wishes.end(), before);
    const auto sameTransform = [](const auto& x, const auto& y) { return x.transform == y.transform; };
    wishes.erase(std::unique(wishes.begin(), wishes.end(), sameTransform), wishes.end());

    std::vector<Mover> movers;
    for (const TentativeTransform& wish : wishes) {
        const Transform* present = committed.get<Transform>(wish.transform);
        if (!present) {
            result.stopped.push_back(wish.transform);
            continue;
        }
        const Mover mover{wish, {valueOf(*present), valueOf(wish)}};
        const bool granted = possible(mover.way.end);
        if (granted && !moves(mover)) {
            result.accepted.push_back(wish);
        } else if (granted && !turnsInsideOut(mover.way) && canBeShown(mover)) {
            movers.push_back(mover);
        } else {
            result.accepted.push_back(withValue(wish, mover.way.start));
            result.stopped.push_back(wish.transform);
        }
    }
    return movers;
}

/// No part that has a body now would lose it (by numbers too large or too small to work with).
bool CollisionPipeline::Impl::canBeShown(const Mover& mover) const {
    for (const std::uint32_t place : handler.placesOf(mover.wish.transform)) {
        const auto [first, last] = handler.partsBelow(place);
        for (std::uint32_t i = first; i < last; ++i) {
            if (!handler.parts()[i].solid()) continue;
            const PartOnTheWay part(handler, i, mover.wish.transform);
            if (!invertible(part.world(localOf(mover.way.end)))) return false;
        }
    }
    return true;
}

void CollisionPipeline::Impl::findNeighbours(std::span<const Mover> movers, Step& step) {
    const std::span<const Part> parts = handler.parts();
    std::vector<std::uint32_t> stale = handler.takeMoved();
    if (generation != handler.generation()) {
        generation = handler.generation();
        std::vector<Box> boxes;
        boxes.reserve(parts.size());
        for (const Part& part : parts) boxes.push_back(part.worldBox);
        neighbours->reset(boxes, handler.interactions());
        memory.clear();
    } else {
        stale.insert(stale.end(), swept.begin(), swept.end());
        for (const std::uint32_t i : stale) neighbours->move(i, parts[i].worldBox);
    }
    swept.clear();
    for (const Mover& mover : movers)
        for (const std::uint32_t place : handler.placesOf(mover.wish.transform)) {
            const auto [first, last] = handler.partsBelow(place);
            for (std::uint32_t i = first; i < last; ++i) swept.push_back(i);
        }
    std::sort(swept.begin(), swept.end());
    swept.erase(std::unique(swept.begin(), swept.end()), swept.end());
    const WayLookup wayOf = [&](ObjectId id) -> const Way* {
        const auto it = std::lower_bound(movers.begin(), movers.end(), id,
                                         [](const Mover& m, ObjectId value) { return m.wish.transform < value; });
        return it != movers.end() && it->wish.transform == id ? &it->way : nullptr;
    };
    for (const std::uint32_t i : swept)
        if (parts[i].solid()) neighbours->move(i, boxOnAllWays(handler, i, wayOf));
    const std::span<const NeighbourPair> near = neighbours->pairs();
    step.near.assign(near.begin(), near.end());
}

std::vector<PartPair> CollisionPipeline::Impl::pairsOf(const Mover& mover, const Step& step) const {
    std::unordered_map<std::uint32_t, std::uint32_t> carriers;  // moved part -> the place that carries it
    for (const std::uint32_t place : handler.placesOf(mover.wish.transform)) {
        const auto [first, last] = handler.partsBelow(place);
        for (std::uint32_t i = first; i < last; ++i) carriers[i] = place;  // ascending, so the nearest one stays
    }
    const auto carrierOf = [&](std::uint32_t part) {
        const auto it = carriers.find(part);
        return it == carriers.end() ? Place::kNone : it->second;
    };
    std::vector<PartPair> pairs;
    for (const NeighbourPair& pair : step.near) {
        // Two that stand still, or are carried together, are as far apart as before.
        if (carrierOf(pair.a) == carrierOf(pair.b) || !handler.relation(pair.a, pair.b).stop) continue;
        pairs.push_back(ordered(pair));
    }
    return pairs;
}

void CollisionPipeline::Impl::move(const Mover& mover, Step& step) {
    StepResult& result = step.result;
    Resolution resolution;
    resolution.accepted = mover.way.end;
    const std::vector<PartPair> pairs = pairsOf(mover, step);
    if (!pairs.empty()) {
        const auto touchingAtStart = [&](std::uint32_t a, std::uint32_t b) -> std::uint64_t {
            if (!handler.parts()[a].worldBox.overlaps(handler.parts()[b].worldBox)) return 0;
            const FacePairs& faces = memory.state(handler, a, b, step.work, result.counters.pairsTested).faces;
            // An undecided start is taken for contact; the response will not get far with it.
            result.counters.notLookedAt += !faces.complete;
            return faces.complete ? faces.pairs.size() : std::max<std::uint64_t>(faces.pairs.size(), 1);
        };
        const MotionTrial trial(handler, mover.wish.transform, mover.way, pairs, touchingAtStart,
                                {limits.stopTolerance, limits.arcTolerance, limits.maxPieces}, step.work,
                                result.counters.pairsTested);
        resolution = stop.resolve(trial);
        for (Hit& found : resolution.hits) {
            const Hit& hit = step.hits.emplace_back(std::move(found));
            const Obstacle& o = trial.obstacles()[hit.obstacle];
            touch(o.partA, o.partB, hit.faces, hit.worldA, hit.worldB, step);
        }
    }
    result.counters.notLookedAt += resolution.undecided;
    result.accepted.push_back(withValue(mover.wish, resolution.accepted));
    if (resolution.stopped) result.stopped.push_back(mover.wish.transform);
    handler.overlay(mover.wish.transform, localOf(resolution.accepted));
}

void CollisionPipeline::Impl::touch(std::uint32_t partA, std::uint32_t partB, const std::vector<FacePair>& faces,
                                    const Affine3d& worldA, const Affine3d& worldB, Step& step) const {
    if (faces.empty()) return;
    const ObjectPair objects(handler.parts()[partA].node, handler.parts()[partB].node);
    step.touching.push_back({objects, partA, partB, &faces, worldA, worldB});
}

/// Found in A's frame, where the predicate decided. The normal goes to the world as planes do, which also rights it
/// where a mirrored frame turned the winding.
Contact CollisionPipeline::Impl::contactAt(const Touching& touching, const FacePair& faces) const {
    const TriangleMesh& meshA = handler.parts()[touching.partA].shape->mesh();
    const TriangleMesh& meshB = handler.parts()[touching.partB].shape->mesh();
    const Affine3d a_T_b = touching.worldA.inverse() * touching.worldB;
    Triangle triangleB = transformed(a_T_b, meshB.triangle(faces.b));
    if (a_T_b.linear().determinant() < 0) std::swap(triangleB[1], triangleB[2]);
    const TriangleContact local = contactOf(meshA.triangle(faces.a), triangleB);
    const Mat3d world_N_a = touching.worldA.linear().inverse().transpose();
    return {touching.objects.first,
            touching.objects.second,
            faces.a,
            faces.b,
            touching.worldA * local.point,
            (world_N_a * local.normal).stableNormalized()};
}

/// Everything that touches in the poses that were accepted.
void CollisionPipeline::Impl::touchAtRest(Step& step) {
    for (const NeighbourPair& pair : step.near) {
        const auto [a, b] = ordered(pair);
        if (!handler.parts()[a].worldBox.overlaps(handler.parts()[b].worldBox)) continue;
        const PairState& now = memory.state(handler, a, b, step.work, step.result.counters.pairsTested);
        step.result.counters.notLookedAt += !now.faces.complete;
        touch(a, b, now.faces.pairs, handler.parts()[a].world, handler.parts()[b].world, step);
    }
}

/// Sorts what touches and works out the first maxContacts of it.
void CollisionPipeline::Impl::listContacts(Step& step) {
    std::stable_sort(step.touching.begin(), step.touching.end(),
                     [](const Touching& x, const Touching& y) { return x.objects < y.objects; });
    std::vector<std::pair<FacePair, const Touching*>> faces;
    for (std::size_t begin = 0, end = 0; begin < step.touching.size(); begin = end) {
        faces.clear();
        for (; end < step.touching.size() && step.touching[end].objects == step.touching[begin].objects; ++end)
            for (const FacePair& f : *step.touching[end].faces) faces.emplace_back(f, &step.touching[end]);
        // A pair can be hit by several movers in turn: the first account of two faces stays.
        std::stable_sort(faces.begin(), faces.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
        const auto same = [](const auto& x, const auto& y) { return x.first == y.first; };
        faces.erase(std::unique(faces.begin(), faces.end(), same), faces.end());
        for (const auto& [pair, touching] : faces) {
            if (step.result.contacts.size() == limits.maxContacts)
                ++step.result.counters.contactsLeftOut;
            else
                step.result.contacts.push_back(contactAt(*touching, pair));
        }
    }
}

void CollisionPipeline::Impl::finish(Step& step) {
    StepResult& result = step.result;
    const auto byTransform = [](const auto& x, const auto& y) { return x.transform < y.transform; };
    std::sort(result.accepted.begin(), result.accepted.end(), byTransform);
    std::sort(result.stopped.begin(), result.stopped.end());

    listContacts(step);
    std::vector<ObjectPair> now;
    now.reserve(step.touching.size());
    for (const Touching& t : step.touching)
        if (now.empty() || now.back() != t.objects) now.push_back(t.objects);
    for (const ObjectPair& pair : now)
        result.contactsBegun += !std::binary_search(touchedBefore.begin(), touchedBefore.end(), pair);
    touchedBefore = std::move(now);

    StepCounters& counters = result.counters;
    counters.objects = handler.parts().size();
    counters.skipped = handler.partsSkipped();
    counters.neighbours = step.near.size();
    counters.boxTests = step.work.boxTests;
    counters.triangleTests = step.work.triangleTests;
    counters.notLookedAt += handler.interestsLeftOut();
    memory.endStep();
}

CollisionPipeline::CollisionPipeline(CollisionLimits limits) : impl_(std::make_unique<Impl>(limits)) {}
CollisionPipeline::~CollisionPipeline() = default;
CollisionPipeline::CollisionPipeline(CollisionPipeline&&) noexcept = default;
CollisionPipeline& CollisionPipeline::operator=(CollisionPipeline&&) noexcept = default;

void CollisionPipeline::sceneChanged(const Aspect& aspect, const ChangeList* list) {
    impl_->handler.update(aspect, list);
}

StepResult CollisionPipeline::step(const Aspect& committed, std::span<const TentativeTransform> wanted) {
    return impl_->run(committed, wanted);
}

std::optional<PickHit> CollisionPipeline::pickNode(const Aspect& aspect, const Ray& ray) {
    return impl_->picker.pick(aspect, ray);
}

}  // namespace tessera
