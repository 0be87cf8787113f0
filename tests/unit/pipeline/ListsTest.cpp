/// The lists of a step are those of that step, whenever somebody looks at them.
#include <cstdlib>
#include <string>

#include "server/collision/pipeline/CollisionPipeline.h"
#include "tests/unit/objects/RandomScene.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

auto whole(const Contact& c) {
    return std::tuple(c.objectA, c.objectB, c.faceA, c.faceB, c.point.x(), c.normal.x(), c.interest, c.time);
}
auto whole(const PairEvent& e) {
    return std::tuple(e.interest, e.objectA, e.objectB, e.phase, e.firstTime, e.point.x(), e.normal.x(), e.through);
}
auto whole(const PairDistance& d) {
    return std::tuple(d.interest, d.objectA, d.objectB, d.phase, d.distance, d.faceA, d.faceB, d.pointA.x());
}

template <typename Entry>
void expectSame(const std::vector<Entry>& a, const std::vector<Entry>& b, const char* what) {
    ASSERT_EQ(a.size(), b.size()) << what;
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(whole(a[i]), whole(b[i])) << what << " " << i;
}

template <typename Entry>
std::vector<Entry> changesIn(const std::vector<Entry>& all) {
    std::vector<Entry> out;
    for (const Entry& entry : all)
        if (entry.phase != Phase::kStays) out.push_back(entry);
    return out;
}

/// Two pipelines see one history; the lists of one are looked at when all has gone on.
TEST(Lists, AreThoseOfTheirStepWhenTheyAreMadeLater) {
    std::size_t contacts = 0, stays = 0, near = 0, cut = 0;
    std::uint32_t first = 1, last = 60;
    if (const char* hunt = std::getenv("TESSERA_HUNT")) last = static_cast<std::uint32_t>(std::atoi(hunt));
    if (const char* only = std::getenv("TESSERA_LISTS_SEED"))
        first = last = static_cast<std::uint32_t>(std::atoi(only));
    constexpr std::uint32_t kFlatWhereItIsMet = 769;  // a scale passes through zero on the way
    std::vector<std::uint32_t> seeds;
    for (std::uint32_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
    if (first != last) seeds.push_back(kFlatWhereItIsMet);
    for (const std::uint32_t seed : seeds) {
        SCOPED_TRACE("TESSERA_LISTS_SEED=" + std::to_string(seed) + " bin/unit_pipeline --gtest_filter=Lists.*");
        RandomScene scene(seed);
        CollisionLimits limits;
        if (seed % 4 == 1) limits.maxContacts = 1 + seed % 7;
        if (seed % 4 == 2) limits.maxEvents = 1 + seed % 3;
        CollisionPipeline now(limits), later(limits);
        now.sceneChanged(scene.aspect, nullptr);
        later.sceneChanged(scene.aspect, nullptr);
        StepResult lookedAt, kept;
        for (int list = 0; list < 50; ++list) {
            for (std::uint32_t several = scene.below(3); several > 0; --several)
                if (const auto applied = scene.next()) {
                    now.sceneChanged(scene.aspect, applied.get());
                    later.sceneChanged(scene.aspect, applied.get());
                }
            std::vector<TentativeTransform> wanted;
            for (std::uint32_t k = scene.below(3); k > 0; --k)
                if (const ObjectId id = scene.some(typeOf<Transform>()); id && scene.aspect.get<Transform>(id)) {
                    const Transform t = scene.someTransform();
                    wanted.push_back(
                        {.transform = id, .translation = t.translation, .rotation = t.rotation, .scale = t.scale});
                }
            const StepResult mine = now.step(scene.aspect, wanted);
            const std::size_t sizes[] = {mine.contacts.size(), mine.events.size(), mine.distances.size()};
            const DistanceList::Near nearest = mine.distances.near();
            ASSERT_EQ(sizes[0], mine.contacts.all().size());
            ASSERT_EQ(sizes[1], mine.events.all().size());
            ASSERT_EQ(sizes[2], mine.distances.all().size());
            expectSame(mine.events.changes(), changesIn(mine.events.all()), "changes of events");
            expectSame(mine.distances.changes(), changesIn(mine.distances.all()), "changes of distances");
            const DistanceList::Near counted = DistanceList::nearOf(mine.distances.all());
            ASSERT_EQ(std::tuple(nearest.count, nearest.least), std::tuple(counted.count, counted.least));

            for (const Contact& c : mine.contacts.all()) ASSERT_TRUE(c.point.allFinite() && c.normal.allFinite());
            for (const PairEvent& e : mine.events.all()) ASSERT_TRUE(e.point.allFinite() && e.normal.allFinite());

            const StepResult other = later.step(scene.aspect, wanted);
            expectSame(lookedAt.contacts.all(), kept.contacts.all(), "contacts");
            expectSame(lookedAt.events.all(), kept.events.all(), "events");
            expectSame(lookedAt.distances.all(), kept.distances.all(), "distances");
            if (testing::Test::HasFatalFailure()) return;
            contacts += sizes[0];
            stays += sizes[1] - mine.events.changes().size();
            near += nearest.count;
            cut += mine.counters.contactsLeftOut > 0 || mine.counters.eventsLeftOut > 0;
            lookedAt = mine;
            kept = other;
        }
    }
    if (first == last) return;
    EXPECT_GT(contacts, 1'000u);
    EXPECT_GT(stays, 500u);
    EXPECT_GT(near, 20u);
    EXPECT_GT(cut, 50u);
}

TEST(Lists, ThatNobodyAskedForAreLetGo) {
    SceneMaker scene;
    const auto floor = scene.body(kRootNode, shapes::box(Vec3d(4, 1, 4)), Vec3d(0, -0.5, 0));
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0.4, 0));
    scene.interest(box.node, floor.node, Interest::kReport);
    StepResult result = scene.pipeline.step(scene.aspect, {});
    ASSERT_FALSE(result.contacts.empty());
    const StepResult copy = result;
    EXPECT_EQ(result.contacts.all().size(), copy.contacts.size());
    scene.pipeline.forgetLists();
    EXPECT_FALSE(copy.contacts.empty()) << "made before";
    EXPECT_EQ(copy.events.size(), 0u) << "nobody had asked";
    result = scene.pipeline.step(scene.aspect, {});
    EXPECT_EQ(result.events.all().size(), 1u);
    EXPECT_EQ(result.events.front().phase, Phase::kStays);
    EXPECT_TRUE(result.events.changes().empty());
}

}  // namespace
}  // namespace tessera
