// What a ray through the scene hits.
#include <gtest/gtest.h>

#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

TEST(Pick, TheNearestVisibleTriangle) {
    SceneMaker scene;
    scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -5));
    const auto near = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    const std::optional<PickHit> hit = scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, near.shape);
    EXPECT_DOUBLE_EQ(hit->t, 1.5);
    EXPECT_TRUE(hit->details.normal.isApprox(Vec3d::UnitZ()));
    EXPECT_NEAR(hit->details.weights.sum(), 1, 1e-15);
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), Vec3d::UnitZ()}));
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.6, 0, 0), -Vec3d::UnitZ()}));
}

TEST(Pick, WhatIsLargeIsPutDownFirstAndThenKept) {
    SceneMaker scene;
    const auto near = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    const auto far = scene.body(kRootNode, shapes::box(Vec3d(9, 9, 1)), Vec3d(0, 0, -5));
    const auto cache = std::make_shared<ShapeCache>(0);  // keeps nothing that nobody holds
    ObjectHandler handler(cache);
    handler.update(scene.aspect, nullptr);
    ScenePicker picker(cache);
    const auto pick = [&](double x, std::optional<UnmadeShape>& unmade) {
        PickPatience patience{.maxMadeFaces = 4};
        const auto hit = picker.pick(scene.aspect, handler, {Vec3d(x, 0.1, 0), -Vec3d::UnitZ()}, &patience);
        unmade = patience.unmade;
        return hit;
    };
    std::optional<UnmadeShape> unmade;
    EXPECT_FALSE(pick(0.1, unmade)) << "what is far may not be told while something nearer is not there";
    ASSERT_TRUE(unmade) << "the nearest, and not what it hides";
    const UnmadeShape first = *unmade;
    cache->put(*unmade, makeShape(*unmade));
    EXPECT_EQ(pick(0.1, unmade)->node, near.shape);
    EXPECT_FALSE(pick(3, unmade));
    ASSERT_TRUE(unmade);
    cache->put(*unmade, makeShape(*unmade));
    EXPECT_EQ(pick(3, unmade)->node, far.shape);
    // What nobody has asked about in the end goes.
    ShapeCache other;
    other.put(first, makeShape(first));
    EXPECT_TRUE(other.isMade(first.arrays));
    other.drop(first);
    EXPECT_FALSE(other.isMade(first.arrays));
    cache->forgetIdle();
    EXPECT_EQ(pick(0.1, unmade)->node, near.shape) << "both are asked about";
    EXPECT_EQ(pick(3, unmade)->node, far.shape);
    EXPECT_FALSE(unmade);
    // Too much to look at: nothing, and not something.
    PickPatience little{.work = {.limit = 1}};
    EXPECT_FALSE(picker.pick(scene.aspect, handler, {Vec3d(3, 0.1, 0), -Vec3d::UnitZ()}, &little));
    EXPECT_TRUE(little.work.exhausted());
}

TEST(Pick, APointIsAsLargeAsItsRadius) {
    SceneMaker scene;
    const std::vector<float> places = {0, 0, 0, 3, 0, 0};
    const ObjectId points = scene.geometry({places, {}});
    const ObjectId node = scene.node(scene.node(kRootNode, scene.transform(Vec3d(0, 0, -5))), points);
    const auto pick = [&](double x, double y) {
        return scene.pipeline.pickNode(scene.aspect, {Vec3d(x, y, 0), -Vec3d::UnitZ()});
    };
    EXPECT_FALSE(pick(3, 0)) << "triangles without indices";
    scene.set<Geometry>(points, fieldId<&Geometry::primitive>, Geometry::kPoints);
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.5);
    const std::optional<PickHit> hit = pick(3.1, 0.1);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, node);
    EXPECT_EQ(hit->face, 8u) << "of the second point, where +X, +Y and +Z meet";
    EXPECT_NEAR(hit->t, 5 - 0.3, 1e-6) << "|x| + |y| + |z| = radius";
    EXPECT_TRUE(pick(0, 0.45));
    EXPECT_FALSE(pick(1.5, 0)) << "between the two";
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.2);
    EXPECT_FALSE(pick(0, 0.45)) << "smaller now";
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.0);
    EXPECT_TRUE(pick(0, 0.0005)) << "of no radius: a two-thousandth of 3";
    EXPECT_FALSE(pick(0, 0.0016));
}

TEST(Pick, GoesThroughWhatTakesPartInNothing) {
    SceneMaker scene;
    const auto far = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -5));
    CollisionObject object;
    object.layers = 0;
    const ObjectId core = scene.object(object);
    const ObjectId marks = scene.node(kRootNode, core);
    scene.body(marks, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    EXPECT_NE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()})->node, far.shape);
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::node>, marks);
    EXPECT_EQ(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()})->node, far.shape);
}

/// A step's values are laid over the scene until it has them: who picks meanwhile changes nothing for later picks.
TEST(Pick, WhatAStepHasMovedIsHitWhereTheSceneHasIt) {
    const Ray here{Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()}, there{Vec3d(5.1, 0.2, 0), -Vec3d::UnitZ()};
    for (const bool first : {false, true})
        for (const bool committed : {false, true}) {
            SCOPED_TRACE(testing::Message() << "first " << first << ", committed " << committed);
            SceneMaker scene;
            const auto moving = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
            scene.interest(moving.node);
            if (first) {
                EXPECT_TRUE(scene.pipeline.pickNode(scene.aspect, here));
            }
            const TentativeTransform wish{.transform = moving.transform, .translation = Vec3d(5, 0, -2)};
            ASSERT_EQ(scene.pipeline.step(scene.aspect, std::vector{wish}).accepted.size(), 1u);
            EXPECT_TRUE(scene.pipeline.pickNode(scene.aspect, here)) << "it is not there yet";
            EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, there));
            if (committed)
                scene.commit(wish);
            else
                scene.node(kRootNode);
            EXPECT_EQ(scene.pipeline.pickNode(scene.aspect, here).has_value(), !committed);
            EXPECT_EQ(scene.pipeline.pickNode(scene.aspect, there).has_value(), committed);
        }
}

}  // namespace
}  // namespace tessera
