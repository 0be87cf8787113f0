/// Stops against brute force, in scenes nobody thought of.
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

/// Bodies in nested frames, scaled unevenly and mirrored; some watch the others.
struct RandomScene : TrialScene {
    Dice dice;
    std::vector<ObjectId> transforms, ofObject, ofOthers;

    explicit RandomScene(unsigned seed) : dice(seed) {
        const ObjectId object = frame(kRootNode), others = frame(kRootNode), deeper = frame(others);
        for (int i = 0; i < 3; ++i) ofObject.push_back(randomBody(object));
        for (int i = 0; i < 6; ++i) ofOthers.push_back(randomBody(i % 2 ? others : deeper));
        watch(object, others);
    }
    ObjectId frame(ObjectId parent) {
        transforms.push_back(transform(dice.vector(-1, 1), dice.rotation(),
                                       Vec3d(dice.uniform(0.5, 1.5), dice.uniform(0.5, 1.5), -dice.uniform(0.5, 1.5))));
        return node(parent, transforms.back());
    }
    ObjectId randomBody(ObjectId parent) {
        const Thing made = body(
            parent, dice.chance(0.5) ? bodies::box(dice.vector(0.2, 1)) : bodies::sphere(dice.uniform(0.2, 0.6), 6, 9),
            dice.vector(-1.5, 1.5), dice.rotation());
        transforms.push_back(made.transform);
        return made.shape;
    }
    using Pairs = std::set<std::pair<ObjectId, ObjectId>>;
    /// All pairs, all faces, straight from the committed scene.
    [[nodiscard]] Pairs touchingPairs() const {
        Pairs out;
        for (const ObjectId a : ofObject)
            for (const ObjectId b : ofOthers)
                if (touching(a, b)) out.emplace(a, b);
        return out;
    }
};

TEST(RandomScenes, NothingThatWasApartEverMeetsNotEvenOnTheWay) {
    int stops = 0, moves = 0, near = 0;
    for (unsigned seed = 100; seed < 115; ++seed) {
        RandomScene scene(seed);
        for (int move = 0; move < 30; ++move) {
            const auto again = [&] { return testing::Message() << "seed " << seed << ", move " << move; };
            const RandomScene::Pairs before = scene.touchingPairs();
            const ObjectId id = scene.transforms[static_cast<std::size_t>(
                scene.dice.uniform(0, static_cast<double>(scene.transforms.size())))];
            const double reach = move % 3 == 2 ? 5.0 : 0.5;
            const Pose from = scene.at(id);
            const Pose wanted{from.translation + scene.dice.vector(-reach, reach),
                              from.rotation.slerp(scene.dice.uniform(0, 0.6), scene.dice.rotation()),
                              from.scale * scene.dice.uniform(0.9, 1.1)};
            const Resolution result = scene.go(id, wanted);
            ++moves;
            stops += result.stopped;
            const Pose accepted = scene.at(id);
            const RandomScene::Pairs now = scene.touchingPairs();
            ASSERT_TRUE(std::includes(before.begin(), before.end(), now.begin(), now.end())) << again();
            const Way way{from, accepted};
            for (int s = 1; s < 24; ++s) {
                scene.put(id, way.at(s / 24.0));
                const RandomScene::Pairs between = scene.touchingPairs();
                ASSERT_TRUE(std::includes(before.begin(), before.end(), between.begin(), between.end()))
                    << again() << ", sample " << s;
            }
            scene.put(id, accepted);
            if (!result.stopped || result.hits.empty() || result.undecided > 0) continue;
            const auto resting = [](const Obstacle& o) { return o.touchingAtStart != 0; };
            if (std::any_of(scene.obstacles.begin(), scene.obstacles.end(), resting)) continue;
            // It stopped for something that is as near as the tolerance says.
            double least = 1e300, tolerance = 0;
            for (const Hit& hit : result.hits) {
                const Obstacle& o = scene.obstacles[hit.obstacle];
                least = std::min(
                    least, scene.distance(scene.handler.parts()[o.partA].node, scene.handler.parts()[o.partB].node));
                for (const std::uint32_t part : {o.partA, o.partB})
                    tolerance = std::max(tolerance, 1e-4 * scene.handler.parts()[part].worldBox.size().norm());
            }
            ASSERT_LE(least, tolerance) << again();
            ++near;
        }
    }
    EXPECT_GT(stops, 40);
    EXPECT_GT(moves, 2 * stops);
    EXPECT_GT(near, 30);
    std::printf("%d moves, %d stops, %d measured\n", moves, stops, near);
}

TEST(RandomScenes, TheSameMotionsGiveTheSamePosesBitForBit) {
    for (unsigned seed = 200; seed < 203; ++seed) {
        RandomScene one(seed), two(seed);
        for (int move = 0; move < 20; ++move) {
            const ObjectId id = one.transforms[static_cast<std::size_t>(move) % one.transforms.size()];
            const Vec3d by = one.dice.vector(-1, 1);
            for (RandomScene* scene : {&one, &two}) scene->goTo(id, scene->placeOf(id) + by);
            ASSERT_EQ(one.aspect.stateHash(), two.aspect.stateHash()) << "seed " << seed << ", move " << move;
            ASSERT_EQ(one.work.boxTests, two.work.boxTests);
            ASSERT_EQ(one.work.triangleTests, two.work.triangleTests);
            ASSERT_EQ(one.queries, two.queries);
        }
    }
}

}  // namespace
}  // namespace tessera
