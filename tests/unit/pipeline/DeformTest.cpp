// Bodies whose vertices move.
#include <gtest/gtest.h>

#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// A tent over a square: its top is the one vertex that moves.
shapes::Soup tent(double height) {
    shapes::Soup soup;
    for (const Vec3d& p : {Vec3d(-2, 0, -2), Vec3d(2, 0, -2), Vec3d(2, 0, 2), Vec3d(-2, 0, 2), Vec3d(0, height, 0)})
        soup.vertex(p);
    soup.indices = {0, 4, 1, 1, 4, 2, 2, 4, 3, 3, 4, 0, 0, 1, 2, 0, 2, 3};
    return soup;
}

struct TentAndBox : SceneMaker {
    Body cloth = body(kRootNode, tent(1), Vec3d::Zero());
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 4, 0));  // its underside at 3.5

    explicit TentAndBox(std::int64_t response, double mass = 0) {
        CollisionObject object;
        object.node = cloth.node;
        object.kind = CollisionObject::kDeforming;
        this->object(object);
        object.node = box.node;
        object.kind = CollisionObject::kRigid;
        object.mass = mass;
        this->object(object);
        Interest fields;
        fields.object = box.node;
        fields.against = cloth.node;
        fields.response = response;
        fields.mode = Interest::kDynamic;
        interest(fields);
        frame();
    }
    void raise(double height) {
        const shapes::Soup soup = tent(height);
        set<Geometry>(aspect.get<Node>(cloth.shape)->core, fieldId<&Geometry::positions>,
                      Blob::of(std::span<const float>(soup.positions)));
    }
};

/// A box whose faces have vertices of their own is closed while these meet. Depth and normal of a region are those of a
/// pipeline that sees the scene for the first time, whether a crack opens or is shut.
TEST(Deforming, ACrackThatOpensOrIsShutChangesTheDepthAtOnce) {
    shapes::Soup whole = shapes::box(Vec3d::Ones()), faces;
    for (const std::uint32_t v : whole.indices) {
        faces.indices.push_back(static_cast<std::uint32_t>(faces.positions.size() / 3));
        for (std::uint32_t k = 0; k < 3; ++k) faces.positions.push_back(whole.positions[3 * v + k]);
    }
    SceneMaker scene;
    const auto box = scene.body(kRootNode, faces, Vec3d::Zero());
    const auto other = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0.3, 0.9, 0.2));
    CollisionObject object;
    object.node = box.node;
    object.kind = CollisionObject::kDeforming;
    scene.object(object);
    Interest fields;
    fields.object = other.node;
    fields.against = box.node;
    fields.response = Interest::kReport;
    scene.interest(fields);
    const float shut = faces.positions[0];
    for (const float x : {shut, shut - 0.3f, shut, shut - 0.1f}) {
        faces.positions[0] = x;
        scene.set<Geometry>(scene.aspect.get<Node>(box.shape)->core, fieldId<&Geometry::positions>,
                            Blob::of(std::span<const float>(faces.positions)));
        const StepResult result = scene.frame();
        CollisionPipeline fresh;
        fresh.sceneChanged(scene.aspect, nullptr);
        const StepResult expected = fresh.step(scene.aspect, {}, {});
        ASSERT_FALSE(result.contacts.empty());
        ASSERT_EQ(result.contacts.size(), expected.contacts.size());
        for (std::size_t i = 0; i < result.contacts.size(); ++i) {
            EXPECT_EQ(result.contacts[i].depth, expected.contacts[i].depth) << x;
            EXPECT_EQ(result.contacts[i].normal, expected.contacts[i].normal) << x;
        }
        EXPECT_EQ(result.contacts.front().depth >= 0, x == shut);
    }
}

TEST(Deforming, AVertexThatRisesIntoABodyIsToldWithItsTime) {
    TentAndBox scene(Interest::kReport);
    scene.raise(2);
    EXPECT_TRUE(scene.frame().events.empty());
    scene.raise(4);
    const StepResult result = scene.frame();
    ASSERT_EQ(result.events.size(), 1u);
    EXPECT_EQ(result.events.front().phase, Phase::kBegan);
    // From 2 to 4: it passes 3.5 after three quarters.
    EXPECT_NEAR(result.events.front().firstTime, 0.75, 1e-3);
    EXPECT_NEAR(result.events.front().point.y(), 3.5, 1e-2);
    EXPECT_FALSE(result.contacts.empty());
    scene.raise(1);
    EXPECT_EQ(scene.frame().events.front().phase, Phase::kEnded);
}

TEST(Deforming, WhatComesAndGoesWithinOneFrameIsATeleportOfTheArray) {
    // Two edits of one frame: the last counts, and nothing was between.
    TentAndBox scene(Interest::kReport);
    scene.raise(5);
    scene.raise(1.5);
    EXPECT_TRUE(scene.frame().events.empty());
}

TEST(Deforming, MotionsStopAtTheNewShape) {
    TentAndBox scene(Interest::kStop);
    scene.raise(2);
    scene.frame({{.transform = scene.box.transform, .translation = Vec3d(0, 0, 0)}});
    EXPECT_NEAR(scene.at(scene.box.transform).translation.y(), 2.5, 1e-3);
}

TEST(Deforming, FreeBodiesAreLifted) {
    TentAndBox scene(Interest::kBounce, 1);
    scene.gravity(Vec3d(0, -10, 0));
    for (int i = 0; i < 60; ++i) scene.frame();
    for (int i = 0; i < 60; ++i) {
        scene.raise(1 + 0.02 * i);
        scene.frame();
    }
    const Transform& at = scene.at(scene.box.transform);
    EXPECT_TRUE(at.translation.allFinite());
    EXPECT_GT(at.translation.y(), 0) << "it slides down the side, but not through it";
}

TEST(Deforming, AnotherNumberOfVerticesIsAnotherShape) {
    TentAndBox scene(Interest::kReport);
    const ObjectId geometry = scene.aspect.get<Node>(scene.cloth.shape)->core;
    const shapes::Soup soup = shapes::box(Vec3d(1, 9, 1));
    ChangeListBuilder b;
    b.set(geometry, typeOf<Geometry>(), fieldId<&Geometry::positions>,
          Blob::of(std::span<const float>(soup.positions)));
    b.set(geometry, typeOf<Geometry>(), fieldId<&Geometry::indices>,
          Blob::of(std::span<const std::uint32_t>(soup.indices)));
    scene.apply(b);
    EXPECT_FALSE(scene.frame().contacts.empty());
}

/// A tent below a flap that hangs free, one mesh.
shapes::Soup tentAndFlap(double height) {
    shapes::Soup soup = tent(height);
    for (const Vec3d& p : {Vec3d(-1, 3, -1), Vec3d(1, 3, -1), Vec3d(0, 3, 1)}) soup.vertex(p);
    soup.indices.insert(soup.indices.end(), {5, 6, 7});
    return soup;
}

struct SelfScene : SceneMaker {
    Body cloth = body(kRootNode, tentAndFlap(1), Vec3d::Zero());
    ObjectId core, rule;

    explicit SelfScene(std::int64_t kind = CollisionObject::kDeforming, std::int64_t detail = Interest::kAllFaces) {
        CollisionObject object;
        object.node = cloth.node;
        object.kind = kind;
        core = this->object(object);
        Interest fields;
        fields.object = cloth.node;
        fields.mode = Interest::kSelf;
        fields.detail = detail;
        rule = interest(fields);
    }
    void raise(double height) {
        const shapes::Soup soup = tentAndFlap(height);
        set<Geometry>(aspect.get<Node>(cloth.shape)->core, fieldId<&Geometry::positions>,
                      Blob::of(std::span<const float>(soup.positions)));
    }
};

TEST(SelfCollision, ADeformingThingTellsWhatOfItRunsIntoItself) {
    SelfScene scene;
    EXPECT_TRUE(scene.frame().contacts.empty()) << "what shares corners does not count";
    scene.raise(4);
    const StepResult result = scene.frame();
    ASSERT_EQ(result.contacts.size(), 4u) << "the four sides of the tent pierce the flap";
    for (const Contact& c : result.contacts) {
        EXPECT_EQ(c.objectA, scene.cloth.shape);
        EXPECT_EQ(c.objectB, scene.cloth.shape);
        EXPECT_EQ(c.faceB, 6u);
        EXPECT_NEAR(c.point.y(), 3, 1e-9);
        EXPECT_EQ(c.interest, scene.rule);
    }
    EXPECT_EQ(result.contactsBegun, 1u);
    EXPECT_EQ(scene.frame().contacts.size(), 4u) << "and goes on telling it";
    scene.set<Interest>(scene.rule, fieldId<&Interest::enabled>, false);
    EXPECT_TRUE(scene.frame().contacts.empty());
    scene.set<Interest>(scene.rule, fieldId<&Interest::enabled>, true);
    EXPECT_EQ(scene.frame().contacts.size(), 4u);
    scene.raise(1);
    EXPECT_TRUE(scene.frame().contacts.empty());
}

TEST(SelfCollision, ARigidThingIsLookedAtOnceHoweverItMoves) {
    SelfScene scene(CollisionObject::kRigid, Interest::kYesOrNo);
    scene.raise(4);
    EXPECT_EQ(scene.frame().contacts.size(), 1u);
    const StepResult moved = scene.frame({{.transform = scene.cloth.transform, .translation = Vec3d(5, 0, 0)}});
    ASSERT_EQ(moved.contacts.size(), 1u);
    EXPECT_NEAR(moved.contacts.front().point.x(), 5, 2);
    EXPECT_EQ(moved.counters.triangleTests, 0u);
}

TEST(SelfCollision, WhatTheWorkIsNotEnoughForIsNamedAndAskedAgain) {
    CollisionLimits limits;
    limits.maxTests = 1;
    SceneMaker scene(limits);
    const auto cloth = scene.body(kRootNode, tentAndFlap(4), Vec3d::Zero());
    Interest fields;
    fields.object = cloth.node;
    fields.mode = Interest::kSelf;
    scene.interest(fields);
    for (int frame = 0; frame < 2; ++frame) {
        const StepResult result = scene.frame();
        ASSERT_EQ(result.notLookedAt.size(), 1u) << frame;
        EXPECT_EQ(result.notLookedAt.front().nodeA, cloth.shape);
    }
}

}  // namespace
}  // namespace tessera
