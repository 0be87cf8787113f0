/// The object handler follows the scene: what the next frame sees after each kind of change.
#include <gtest/gtest.h>

#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// A unit box that wants to go to x = 9 past whatever stands at x = 5.
struct Runner : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    ObjectId wish = interest(box.node);

    /// Where it gets from the origin.
    double run() {
        commit({.transform = box.transform});
        frame({{.transform = box.transform, .translation = Vec3d(9, 0, 0)}});
        return at(box.transform).translation.x();
    }
    static shapes::Soup wallShape() { return shapes::box(Vec3d(0.2, 10, 10)); }
    void set(ObjectId id, ObjectType type, FieldId fieldId, const FieldValue& value) {
        ChangeListBuilder b;
        b.set(id, type, fieldId, value);
        apply(b);
    }
    void place(ObjectId id, ObjectId parent) {
        ChangeListBuilder b;
        b.place(id, parent);
        apply(b);
    }
};

constexpr double kAtWall = 4.4, kFree = 9.0, kNear = 1e-3;

TEST(Follow, AWallThatIsSwitchedOffIsNotThere) {
    Runner scene;
    const ObjectId choice = scene.switchCore(Switch::kAll);
    const ObjectId group = scene.node(kRootNode, choice);
    scene.body(group, Runner::wallShape(), Vec3d(5, 0, 0));
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.setChoice(choice, Switch::kNone);
    EXPECT_EQ(scene.run(), kFree);
    scene.setChoice(choice, 0);
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.setChoice(choice, 7);
    EXPECT_EQ(scene.run(), kFree) << "past the last child: none is shown";
}

TEST(Follow, AWallMovesWithItsNewParent) {
    Runner scene;
    const auto wall = scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0));
    const ObjectId shifted = scene.node(kRootNode, scene.transform(Vec3d(1, 0, 0)));
    scene.place(wall.node, shifted);
    EXPECT_NEAR(scene.run(), kAtWall + 1, kNear);
    scene.place(wall.node, ObjectId{});
    EXPECT_EQ(scene.run(), kFree) << "out of the tree";
    scene.place(wall.node, kRootNode);
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.place(wall.node, scene.box.node);
    EXPECT_EQ(scene.run(), kFree) << "part of the object itself";
}

TEST(Follow, AWallThatIsDestroyedOrLosesItsCoreIsGone) {
    Runner scene;
    const auto wall = scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0));
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    const ObjectId core = scene.aspect.get<Node>(wall.shape)->core;
    scene.set(wall.shape, typeOf<Node>(), fieldId<&Node::core>, toValue(ObjectId{}));
    EXPECT_EQ(scene.run(), kFree);
    scene.set(wall.shape, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    ChangeListBuilder b;
    b.detach(wall.shape);
    b.destroy(wall.shape);
    scene.apply(b);
    EXPECT_EQ(scene.run(), kFree);
}

TEST(Follow, NewArraysAreANewShape) {
    Runner scene;
    const auto wall = scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0));
    const ObjectId core = scene.aspect.get<Node>(wall.shape)->core;
    const shapes::Soup thick = shapes::box(Vec3d(2.2, 10, 10));
    scene.set(core, typeOf<Geometry>(), fieldId<&Geometry::positions>,
              Blob::of(std::span<const float>(thick.positions)));
    EXPECT_NEAR(scene.run(), kAtWall - 1, kNear);
}

TEST(Follow, ScalesNonUniformAndMirroredAreRight) {
    Runner scene;
    const auto wall = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(5, 0, 0));
    scene.commit({.transform = wall.transform, .translation = Vec3d(5, 0, 0), .scale = Vec3d(0.2, 10, 10)});
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.commit({.transform = wall.transform, .translation = Vec3d(5, 0, 0), .scale = Vec3d(-2.2, 10, -10)});
    EXPECT_NEAR(scene.run(), kAtWall - 1, kNear);
    scene.commit({.transform = wall.transform, .translation = Vec3d(5, 0, 0), .scale = Vec3d(-1, 9, 9)});
    scene.commit({.transform = scene.box.transform, .translation = Vec3d(0, 0, 0)});
    const StepResult result = scene.frame({{.transform = scene.box.transform, .translation = Vec3d(9, 0, 0)}});
    ASSERT_FALSE(result.contacts.empty());
    for (const Contact& c : result.contacts)
        EXPECT_NEAR((c.normal - Vec3d::UnitX()).norm(), 0, 1e-9) << "a mirrored wall still looks outwards";
    scene.commit({.transform = wall.transform, .translation = Vec3d(5, 0, 0), .scale = Vec3d(0, 1, 1)});
    EXPECT_EQ(scene.run(), kFree) << "flattened: it meets nothing";
    EXPECT_EQ(scene.frame({}).counters.skipped, 1u);
}

TEST(Follow, SharedCoresAreWallsInEveryPlace) {
    Runner scene;
    const ObjectId geometry = scene.geometry(Runner::wallShape());
    const ObjectId right = scene.node(scene.node(kRootNode, scene.transform(Vec3d(5, 0, 0))), geometry);
    const ObjectId left = scene.node(scene.node(kRootNode, scene.transform(Vec3d(-3, 0, 0))), geometry);
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.commit({.transform = scene.box.transform});
    const StepResult result = scene.frame({{.transform = scene.box.transform, .translation = Vec3d(-9, 0, 0)}});
    EXPECT_NEAR(scene.at(scene.box.transform).translation.x(), -2.4, kNear);
    ASSERT_FALSE(result.contacts.empty());
    EXPECT_EQ(result.contacts[0].objectB, left);
    EXPECT_NE(result.contacts[0].objectB, right);
}

TEST(Follow, OneTransformInTwoPlacesIsStoppedByEither) {
    // Two boxes hang on one Transform core under two parents; the second one's way is blocked.
    SceneMaker scene;
    const ObjectId shared = scene.transform(Vec3d::Zero());
    const ObjectId both = scene.node(kRootNode);
    scene.node(scene.node(both, shared), scene.geometry(shapes::box(Vec3d::Ones())));
    const ObjectId shifted = scene.node(both, scene.transform(Vec3d(0, 20, 0)));
    scene.node(scene.node(shifted, shared), scene.geometry(shapes::box(Vec3d::Ones())));
    scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 20, 0));
    scene.interest(both);
    EXPECT_EQ(scene.frame({{.transform = shared, .translation = Vec3d(9, 0, 0)}}).stopped.size(), 1u);
    EXPECT_NEAR(scene.at(shared).translation.x(), kAtWall, kNear);
}

TEST(Follow, InterestsComeGoAndSleep) {
    Runner scene;
    const auto wall = scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0));
    const auto other = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 30, 0));
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    const ObjectType type = typeOf<Interest>();
    scene.set(scene.wish, type, fieldId<&Interest::enabled>, false);
    EXPECT_EQ(scene.run(), kFree);
    EXPECT_EQ(scene.frame({}).counters.objects, 0u);
    scene.set(scene.wish, type, fieldId<&Interest::enabled>, true);
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.set(scene.wish, type, fieldId<&Interest::against>, toValue(other.node));
    EXPECT_EQ(scene.run(), kFree) << "the wall is none of its business any more";
    scene.set(scene.wish, type, fieldId<&Interest::against>, toValue(wall.node));
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.set(scene.wish, type, fieldId<&Interest::response>, toValue(Interest::kReport));
    EXPECT_EQ(scene.run(), kFree);
    scene.set(scene.wish, type, fieldId<&Interest::response>, toValue(Interest::kStop));
    scene.place(wall.node, ObjectId{});
    EXPECT_EQ(scene.run(), kFree) << "asleep while its other side is out of the tree";
    scene.place(wall.node, kRootNode);
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
    scene.set(scene.wish, type, fieldId<&Interest::object>, toValue(ObjectId{}));
    EXPECT_EQ(scene.run(), kFree);
}

TEST(Follow, MalformedAndAbsentGeometryIsSkippedAndCounted) {
    Runner scene;
    const auto wall = scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0));
    const ObjectId core = scene.aspect.get<Node>(wall.shape)->core;
    const FieldValue good = scene.aspect.get<Geometry>(core)->indices;
    EXPECT_EQ(scene.frame({}).counters.skipped, 0u);
    const std::vector<std::uint32_t> beyond{0, 1, 99}, ragged{0, 1};
    for (const auto& bad : {beyond, ragged, std::vector<std::uint32_t>{}}) {
        scene.set(core, typeOf<Geometry>(), fieldId<&Geometry::indices>, Blob::of(std::span<const std::uint32_t>(bad)));
        EXPECT_EQ(scene.run(), kFree);
        EXPECT_EQ(scene.frame({}).counters.skipped, 1u);
    }
    scene.set(core, typeOf<Geometry>(), fieldId<&Geometry::indices>, Blob::absent(BlobId{1, 2}, 36));
    EXPECT_EQ(scene.run(), kFree);
    EXPECT_EQ(scene.frame({}).counters.skipped, 1u);
    scene.set(core, typeOf<Geometry>(), fieldId<&Geometry::indices>, good);
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
}

TEST(Follow, AStepThatIsNotCommittedLeavesNoTrace) {
    Runner scene;
    scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0));
    const TentativeTransform half{.transform = scene.box.transform, .translation = Vec3d(4, 0, 0)};
    EXPECT_EQ(scene.pipeline.step(scene.aspect, std::vector{half}).accepted[0].translation.x(), 4);
    const TentativeTransform up{.transform = scene.box.transform, .translation = Vec3d(0, 30, 0)};
    const StepResult result = scene.pipeline.step(scene.aspect, std::vector{up});
    EXPECT_TRUE(result.stopped.empty());
    EXPECT_TRUE(scene.pipeline.step(scene.aspect, {}).contacts.empty());
    EXPECT_NEAR(scene.run(), kAtWall, kNear);
}

TEST(Follow, ARebuiltPipelineSaysTheSame) {
    Runner scene;
    scene.body(kRootNode, Runner::wallShape(), Vec3d(5, 0, 0), Quatd(0.9, 0.1, 0.2, 0.05));
    scene.run();
    CollisionPipeline fresh;
    fresh.sceneChanged(scene.aspect, nullptr);
    const std::vector wish{TentativeTransform{.transform = scene.box.transform, .translation = Vec3d(9, 1, 0)}};
    const StepResult a = scene.pipeline.step(scene.aspect, wish), b = fresh.step(scene.aspect, wish);
    ASSERT_EQ(a.contacts.size(), b.contacts.size());
    ASSERT_FALSE(a.contacts.empty());
    for (std::size_t i = 0; i < a.contacts.size(); ++i) {
        EXPECT_EQ(a.contacts[i].point, b.contacts[i].point);
        EXPECT_EQ(a.contacts[i].faceB, b.contacts[i].faceB);
    }
    EXPECT_EQ(a.accepted[0].translation, b.accepted[0].translation);
}

TEST(Following, MayBeginWithTheListThatMadeTheScene) {
    SceneMaker maker;
    const auto box = maker.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    const auto wall = maker.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0.5, 0, 0));
    maker.interest(box.node);
    const ChangeList all = snapshot(maker.aspect);
    Aspect aspect;
    ASSERT_TRUE(aspect.apply(all));
    CollisionPipeline pipeline;
    pipeline.sceneChanged(aspect, &all);
    const StepResult result = pipeline.step(aspect, {});
    EXPECT_FALSE(result.contacts.empty());
    const auto hit = pipeline.pickNode(aspect, {Vec3d(0.9, 0.1, 10), Vec3d(0, 0, -1)});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, wall.shape);
}

TEST(ScenePicker, HitsTheNearestVisibleTriangle) {
    SceneMaker scene;
    const ObjectId choice = scene.switchCore(Switch::kAll);
    const ObjectId group = scene.node(kRootNode, choice);
    const auto near = scene.body(group, shapes::box(Vec3d::Ones()), Vec3d(0, 0, 2));
    const auto far = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -3));
    scene.commit({.transform = far.transform, .translation = Vec3d(0, 0, -3), .scale = Vec3d(-4, 4, 2)});
    const Ray ray{Vec3d(0.1, 0.2, 10), Vec3d(0, 0, -2)};
    auto hit = scene.pipeline.pickNode(scene.aspect, ray);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, near.shape);
    EXPECT_NEAR((hit->point - Vec3d(0.1, 0.2, 2.5)).norm(), 0, 1e-12);
    EXPECT_NEAR(hit->t, 3.75, 1e-12);
    EXPECT_TRUE(hit->face == 2 || hit->face == 3) << "the side that looks to +z";
    scene.setChoice(choice, Switch::kNone);
    hit = scene.pipeline.pickNode(scene.aspect, ray);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, far.shape);
    EXPECT_NEAR((hit->point - Vec3d(0.1, 0.2, -2)).norm(), 0, 1e-12);
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0, 9, 10), Vec3d(0, 0, -1)}));
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0, 0, 10), Vec3d::Zero()}));
}

}  // namespace
}  // namespace tessera
