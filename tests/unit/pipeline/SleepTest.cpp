/// Free bodies that sleep cost nothing; what must wake them does, however long nobody has looked at them.
#include <gtest/gtest.h>

#include "common/scene/FieldTable.h"
#include "server/collision/objects/Relation.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// A box that sleeps on another, which sleeps on a floor.
struct Sleeping : SceneMaker {
    Body floor = body(kRootNode, shapes::box(Vec3d(20, 1, 20)), Vec3d(0, -0.5, 0));
    Body below = body(kRootNode, shapes::box(Vec3d(1, 1, 1)), Vec3d(0, 0.5, 0));
    Body above = body(kRootNode, shapes::box(Vec3d(1, 1, 1)), Vec3d(0, 1.5, 0));
    Body pusher = body(kRootNode, shapes::box(Vec3d(1, 1, 1)), Vec3d(6, 0.6, 0));
    ObjectId core;

    Sleeping() {
        gravity(Vec3d(0, -9.81, 0));
        for (const Body& free : {below, above}) {
            CollisionObject fields;
            fields.node = free.node;
            fields.mass = 1;
            fields.shape = CollisionObject::kHull;
            fields.restitution = 0;
            core = object(fields);
        }
        Interest fields;
        fields.object = kRootNode;
        fields.response = Interest::kBounce;
        interest(fields);
        for (int frames = 0; frames < 400; ++frames) (void)frame();
    }
    double height() { return at(above.transform).translation.y(); }
    [[nodiscard]] std::size_t asleep() { return frame().counters.asleep; }
    /// Whether the upper one has fallen by the end of 20 frames.
    [[nodiscard]] bool falls() {
        const double before = height();
        for (int frames = 0; frames < 20; ++frames) (void)frame();
        return height() < before - 0.2;
    }
};

TEST(Sleep, LastsAndIsTold) {
    Sleeping scene;
    const double before = scene.height();
    for (int frames = 0; frames < 50; ++frames) {
        const StepResult result = scene.frame();
        ASSERT_EQ(result.counters.asleep, 2u);
        ASSERT_EQ(result.counters.freeBodies, 2u);
        ASSERT_TRUE(result.accepted.empty());
        ASSERT_EQ(result.contacts.size(), scene.frame().contacts.size());
        ASSERT_FALSE(result.contacts.empty());
    }
    EXPECT_EQ(scene.height(), before);
    EXPECT_FALSE(scene.falls());
}

TEST(Sleep, EndsWhereTheFloorIsMovedAwayByAWish) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    const Vec3d away(0, -30, 0);
    (void)scene.frame({{.transform = scene.floor.transform, .translation = away}});
    EXPECT_TRUE(scene.falls());
}

TEST(Sleep, EndsWhereTheOneBelowIsDestroyed) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    scene.destroy(scene.below.shape);
    EXPECT_TRUE(scene.falls());
}

TEST(Sleep, EndsAlsoWhereTimeStoodAsTheOneBelowWasDestroyed) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    scene.destroy(scene.below.shape);
    for (int frames = 0; frames < 3; ++frames) (void)scene.pipeline.step(scene.aspect, {}, {}, 0);
    EXPECT_TRUE(scene.falls());
}

TEST(Sleep, EndsWhereTheOneBelowIsPutElsewhere) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    scene.commit({.transform = scene.below.transform, .translation = Vec3d(4, 0.5, 0)});
    EXPECT_TRUE(scene.falls());
}

TEST(Sleep, EndsWhereItIsPutElsewhereWhileTimeStands) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    scene.commit({.transform = scene.above.transform, .translation = Vec3d(0, 3, 0)});
    for (int frames = 0; frames < 3; ++frames) (void)scene.pipeline.step(scene.aspect, {}, {}, 0);
    EXPECT_TRUE(scene.falls());
}

/// Whether or not somebody else is awake.
TEST(Sleep, EndsWhereItIsCarriedAway) {
    for (const bool alone : {true, false}) {
        Sleeping scene;
        const ObjectId cart = scene.transform(Vec3d::Zero()), node = scene.node(kRootNode, cart);
        if (!alone) {
            CollisionObject fields;
            fields.node = scene.body(kRootNode, shapes::box(Vec3d(1, 1, 1)), Vec3d(6, 900, 0)).node;
            fields.mass = 1;
            (void)scene.object(fields);
        }
        ChangeListBuilder list;
        list.place(scene.above.node, node);
        scene.apply(list);
        for (int frames = 0; frames < 200; ++frames) (void)scene.frame();
        ASSERT_EQ(scene.asleep(), 2u);
        for (int frames = 1; frames <= 3; ++frames)
            (void)scene.frame({{.transform = cart, .translation = Vec3d(0, 0, 0.8 * frames)}});
        EXPECT_TRUE(scene.falls()) << alone;
    }
}

TEST(Sleep, EndsWhereSomethingPushes) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    for (int frames = 0; frames < 60; ++frames)
        (void)scene.frame(
            {{.transform = scene.pusher.transform, .translation = Vec3d(6 - 0.1 * (frames + 1), 0.6, 0)}});
    EXPECT_LT(scene.at(scene.below.transform).translation.x(), -0.5);
}

TEST(Sleep, EndsWhereAVelocityIsGiven) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::velocity>, Vec3d(0, 3, 0));
    const double before = scene.height();
    for (int frames = 0; frames < 10; ++frames) (void)scene.frame();
    EXPECT_GT(scene.height(), before + 0.2);
}

TEST(Sleep, EndsWhereNobodyIsInterestedAnyMore) {
    Sleeping scene;
    ASSERT_EQ(scene.asleep(), 2u);
    ChangeListBuilder list;
    for (const InterestTerms& interest : scene.pipeline.interests())
        list.set(interest.core, typeOf<Interest>(), fieldId<&Interest::response>, toValue(Interest::kReport));
    scene.apply(list);
    EXPECT_TRUE(scene.falls()) << "nothing holds it";
}

}  // namespace
}  // namespace tessera
