/// After any history a pipeline says what one says that sees the scene for the first time; picks are right after every
/// edit.
#include <cstdlib>
#include <string>

#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/collision/pipeline/CollisionPipeline.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "server/collision/query/RayQuery.h"
#include "tests/unit/objects/RandomScene.h"

namespace tessera {
namespace {

auto told(const PairEvent& e) {
    return std::tuple(e.interest, e.objectA, e.objectB);
}
auto told(const PairDistance& d) {
    return std::tuple(d.interest, d.objectA, d.objectB);
}
/// What is so now, whatever was before.
template <typename Entry>
std::vector<Entry> present(const std::vector<Entry>& all) {
    std::vector<Entry> out;
    for (const Entry& entry : all)
        if (entry.phase != Phase::kEnded) out.push_back(entry);
    return out;
}

void expectSame(const Aspect& aspect, const StepResult& a, const StepResult& b, bool moved) {
    ASSERT_EQ(a.stopped, b.stopped);
    ASSERT_EQ(a.accepted.size(), b.accepted.size());
    for (std::size_t i = 0; i < a.accepted.size(); ++i) {
        ASSERT_EQ(a.accepted[i].transform, b.accepted[i].transform);
        // The tree of points that deformed was fitted anew, not built anew: how far is asked in another order.
        ASSERT_LT((a.accepted[i].translation - b.accepted[i].translation).norm(), 1e-9);
        ASSERT_LT((a.accepted[i].rotation.coeffs() - b.accepted[i].rotation.coeffs()).norm(), 1e-9);
        ASSERT_LT((a.accepted[i].scale - b.accepted[i].scale).norm(), 1e-9);
    }
    ASSERT_EQ(a.counters.objects, b.counters.objects);
    ASSERT_EQ(a.counters.skipped, b.counters.skipped);
    ASSERT_EQ(a.counters.freeBodies, b.counters.freeBodies);
    if (moved) return;  // what stopped a motion is told as long as both stay
    ASSERT_EQ(a.counters.neighbours, b.counters.neighbours);
    ASSERT_EQ(a.contacts.size(), b.contacts.size());
    for (std::size_t i = 0; i < a.contacts.size(); ++i) {
        const Contact &x = a.contacts[i], &y = b.contacts[i];
        ASSERT_EQ(std::tuple(x.objectA, x.objectB, x.interest), std::tuple(y.objectA, y.objectB, y.interest));
        // Of those who want to know no more than that two touch, one pair of faces is as good as another.
        if (aspect.get<Interest>(x.interest)->detail != Interest::kAllFaces) continue;
        ASSERT_EQ(std::tuple(x.faceA, x.faceB), std::tuple(y.faceA, y.faceB));
        ASSERT_TRUE(x.point == y.point && x.normal == y.normal);
    }
    const std::vector<PairEvent> eventsA = present(a.events.all()), eventsB = present(b.events.all());
    ASSERT_EQ(eventsA.size(), eventsB.size());
    for (std::size_t i = 0; i < eventsA.size(); ++i) ASSERT_EQ(told(eventsA[i]), told(eventsB[i]));
    const std::vector<PairDistance> nearA = present(a.distances.all()), nearB = present(b.distances.all());
    ASSERT_EQ(nearA.size(), nearB.size());
    for (std::size_t i = 0; i < nearA.size(); ++i) {
        ASSERT_EQ(told(nearA[i]), told(nearB[i]));
        ASSERT_EQ(nearA[i].distance, nearB[i].distance);
    }
}

/// Every visible triangle, one after the other.
std::optional<PickHit> pickedOneByOne(const Aspect& aspect, ShapeCache& shapes, const Ray& ray) {
    std::optional<PickHit> best;
    Action action;
    action.on<CollisionObject>([](const Visit& visit, const CollisionObject& object) {
        return object.layers == 0 && object.node == visit.nodeId ? Descend::kPast : Descend::kInto;
    });
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        const std::shared_ptr<const CollisionShape> shape = shapes.shape(drawableOf(Object::of(geometry)).arrays());
        const double largest = visit.world_T_node.linear().cwiseAbs().maxCoeff();
        const double determinant = visit.world_T_node.linear().determinant();
        if (!shape || !(std::abs(determinant) > 1e-12 * largest * largest * largest)) return Descend::kInto;
        const Affine3d local = visit.world_T_node.inverse();
        if (!local.matrix().allFinite()) return Descend::kInto;
        const Ray localRay{local * ray.origin, local.linear() * ray.direction};
        const std::optional<RayHit> hit = castRay(shape->tree(), localRay, std::numeric_limits<double>::infinity());
        if (hit && (!best || hit->t < best->t))
            best = PickHit{visit.nodeId, hit->face, ray.origin + hit->t * ray.direction, hit->t};
        return Descend::kInto;
    });
    action.run(aspect);
    return best;
}

TEST(History, LeavesAPipelineAsIfItSawTheSceneForTheFirstTime) {
    std::size_t contacts = 0, distances = 0, stops = 0, hits = 0, still = 0;
    std::uint32_t first = 1, last = 100;
    if (const char* hunt = std::getenv("TESSERA_HUNT")) last = static_cast<std::uint32_t>(std::atoi(hunt));
    if (const char* only = std::getenv("TESSERA_PIPELINE_SEED"))
        first = last = static_cast<std::uint32_t>(std::atoi(only));
    for (std::uint32_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE("TESSERA_PIPELINE_SEED=" + std::to_string(seed));
        RandomScene scene(seed);
        ShapeCache shapes;
        CollisionPipeline pipeline;
        pipeline.sceneChanged(scene.aspect, nullptr);
        const bool moves = seed % 2 == 0;
        for (int list = 0; list < 60; ++list) {
            SCOPED_TRACE("list " + std::to_string(list));
            for (std::uint32_t several = 1 + scene.below(2); several > 0; --several)
                if (const auto applied = scene.next()) pipeline.sceneChanged(scene.aspect, applied.get());
            std::vector<TentativeTransform> wanted;
            for (std::uint32_t k = moves ? scene.below(4) : 0; k > 0; --k)
                if (const ObjectId id = scene.some(typeOf<Transform>()); id && scene.aspect.get<Transform>(id)) {
                    const Transform t = scene.someTransform();
                    wanted.push_back(
                        {.transform = id, .translation = t.translation, .rotation = t.rotation, .scale = t.scale});
                }
            CollisionPipeline fresh;
            fresh.sceneChanged(scene.aspect, nullptr);
            // Deformations happen once, and only to who has seen what was before.
            (void)pipeline.step(scene.aspect, {}, {}, 0);
            if (scene.below(3) == 0) {
                (void)pipeline.step(scene.aspect, {}, {}, 0);
                ++still;
            }
            const StepResult mine = pipeline.step(scene.aspect, wanted, {}, 0),
                             other = fresh.step(scene.aspect, wanted, {}, 0);
            expectSame(scene.aspect, mine, other, moves);
            if (testing::Test::HasFatalFailure()) return;
            contacts += mine.contacts.size();
            distances += mine.distances.size();
            stops += mine.stopped.size();
            for (int k = 0; k < 3; ++k) {
                const auto far = [&] { return scene.between(-12, 12); };
                Ray ray{Vec3d(far(), far(), far()), Vec3d::Zero()};
                ray.direction = Vec3d(scene.between(-4, 4), scene.between(-4, 4), scene.between(-4, 4)) - ray.origin;
                const std::optional<PickHit> hit = pipeline.pickNode(scene.aspect, ray),
                                             right = pickedOneByOne(scene.aspect, shapes, ray);
                ASSERT_EQ(hit.has_value(), right.has_value());
                if (!hit) continue;
                ++hits;
                ASSERT_EQ(hit->node, right->node);
                ASSERT_EQ(hit->face, right->face);
                ASSERT_EQ(hit->t, right->t);
            }
        }
    }
    if (first == last) return;
    EXPECT_GT(contacts, 1'000u);
    EXPECT_GT(distances, 80u);
    EXPECT_GT(stops, 200u);
    EXPECT_GT(hits, 1'000u);
    EXPECT_GT(still, 500u);
}

}  // namespace
}  // namespace tessera
