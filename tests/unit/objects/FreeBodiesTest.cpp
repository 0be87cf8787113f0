/// Which bodies gravity and impulses move.
#include "common/cores/Environment.h"
#include "tests/unit/objects/ObjectScene.h"

namespace tessera {
namespace {

/// A thing of mass 2 below a group with a Transform.
struct Falling : ObjectScene {
    ObjectId above = transform();
    ObjectId group = node(kRootNode, above);
    Thing ball = thing(group);
    ObjectId core = object({.node = ball.node, .mass = 2});
    ObjectId interestId = interest({.object = kRootNode});

    [[nodiscard]] bool isFree() const { return body(ball.shape).free(); }
};

TEST(FreeBodies, ARigidWholeObjectOnATransformOfItsOwnIsFree) {
    Falling scene;
    ASSERT_TRUE(scene.isFree());
    EXPECT_EQ(scene.body(scene.ball.shape).mass, 2);
    EXPECT_EQ(scene.body(scene.ball.shape).transform, scene.ball.transform);
    const std::uint32_t body = scene.handler.freeBodyOf(scene.ball.transform);
    ASSERT_NE(body, kNobody);
    EXPECT_EQ(scene.handler.bodies()[body].node, scene.ball.node);
    EXPECT_EQ(scene.handler.freeBodyOf(scene.above), kNobody);
    EXPECT_EQ(scene.handler.freeBodyOf(ObjectId{}), kNobody);
}

TEST(FreeBodies, MassComesAndGoesWithoutNewTables) {
    Falling scene;
    const std::uint64_t generation = scene.handler.generation();
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::mass>, 0.0);
    EXPECT_FALSE(scene.isFree());
    EXPECT_EQ(scene.handler.freeBodyOf(scene.ball.transform), kNobody);
    EXPECT_EQ(scene.body(scene.ball.shape).mass, 0);
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::mass>, 5.0);
    EXPECT_EQ(scene.body(scene.ball.shape).mass, 5);
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::velocity>, Vec3d(1, 2, 3));
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::spin>, Vec3d(4, 5, 6));
    EXPECT_EQ(scene.body(scene.ball.shape).velocity, Vec3d(1, 2, 3));
    EXPECT_EQ(scene.body(scene.ball.shape).spin, Vec3d(4, 5, 6));
    EXPECT_EQ(scene.handler.generation(), generation);
}

TEST(FreeBodies, OnlyRigidUndividedObjectsAreFree) {
    Falling scene;
    for (const std::int64_t kind : {CollisionObject::kStatic, CollisionObject::kDeforming}) {
        scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::kind>, kind);
        EXPECT_FALSE(scene.isFree());
        EXPECT_EQ(scene.body(scene.ball.shape).mass, 0);
    }
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::kind>, CollisionObject::kRigid);
    EXPECT_TRUE(scene.isFree());
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::division>, CollisionObject::kEachChild);
    EXPECT_FALSE(scene.isFree());
}

TEST(FreeBodies, ASharedTransformCarriesNone) {
    Falling scene;
    const ObjectId twin = scene.node(kRootNode, scene.ball.transform);
    EXPECT_FALSE(scene.isFree());
    scene.place(twin, ObjectId{});
    EXPECT_TRUE(scene.isFree()) << "what is not visible does not matter";
}

TEST(FreeBodies, ANodeWithoutATransformIsNotFree) {
    Falling scene;
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::node>, scene.ball.shape);
    EXPECT_FALSE(scene.isFree());
}

TEST(FreeBodies, WhatIsAboveMustBeRigidButForOneScale) {
    Falling scene;
    const Quatd turned(Eigen::AngleAxisd(1, Vec3d(1, 2, 3).normalized()));
    scene.move(scene.above, Vec3d(1, 2, 3), turned, Vec3d::Constant(2.5));
    EXPECT_TRUE(scene.isFree());
    scene.move(scene.above, Vec3d(1, 2, 3), turned, Vec3d(1, 1, 1.1));
    EXPECT_FALSE(scene.isFree());
    scene.move(scene.above, Vec3d(1, 2, 3), turned, Vec3d(-1, 1, 1));
    EXPECT_FALSE(scene.isFree()) << "mirrored";
    scene.move(scene.above, Vec3d(1, 2, 3), turned, Vec3d(-1, -1, 1));
    EXPECT_TRUE(scene.isFree()) << "half a turn";
    scene.move(scene.above, Vec3d(1, 2, 3), turned, Vec3d::Zero());
    EXPECT_FALSE(scene.isFree());
    scene.move(scene.above, Vec3d::Zero());
    scene.move(scene.ball.transform, Vec3d::Zero(), Quatd::Identity(), Vec3d(1, 2, 3));
    EXPECT_TRUE(scene.isFree()) << "its own scale may be any";
    scene.move(scene.ball.transform, Vec3d::Zero(), Quatd::Identity(), Vec3d(1, 0, 3));
    EXPECT_FALSE(scene.isFree()) << "flat: nothing solid is left";
}

TEST(FreeBodies, TentativePosesCountToo) {
    Falling scene;
    Affine3d squeezed = Affine3d::Identity();
    squeezed.linear().diagonal() = Vec3d(1, 2, 1);
    scene.handler.overlay(scene.above, squeezed);
    EXPECT_FALSE(scene.isFree());
    scene.handler.dropOverlay(scene.aspect);
    EXPECT_TRUE(scene.isFree());
}

TEST(FreeBodies, BelowAnotherFreeBodyNoneIsFree) {
    Falling scene;
    const auto rider = scene.thing(scene.ball.node);
    const ObjectId riderCore = scene.object({.node = rider.node, .mass = 1});
    EXPECT_TRUE(scene.isFree());
    EXPECT_FALSE(scene.body(rider.shape).free());
    scene.set<CollisionObject>(scene.core, fieldId<&CollisionObject::mass>, 0.0);
    EXPECT_TRUE(scene.body(rider.shape).free()) << "the one below it is carried by hand now";
    EXPECT_EQ(scene.body(rider.shape).core, riderCore);
}

TEST(FreeBodies, GravityIsTheFirstEnvironments) {
    Falling scene;
    EXPECT_EQ(scene.handler.gravity(), Vec3d::Zero());
    ChangeListBuilder b;
    const ObjectId first = scene.fresh(), second = ObjectId(first.value + 1);
    for (const ObjectId id : {first, second}) b.create(id, typeOf<Environment>());
    b.set(first, typeOf<Environment>(), fieldId<&Environment::gravity>, toValue(Vec3d(0, -9.81, 0)));
    b.set(second, typeOf<Environment>(), fieldId<&Environment::gravity>, toValue(Vec3d(7, 7, 7)));
    scene.apply(b);
    EXPECT_EQ(scene.handler.gravity(), Vec3d::Zero()) << "no node bears one";
    const ObjectId bearer = scene.node(kRootNode, first);
    scene.node(kRootNode, second);
    EXPECT_EQ(scene.handler.gravity(), Vec3d(0, -9.81, 0));
    const std::uint64_t generation = scene.handler.generation();
    scene.set<Environment>(first, fieldId<&Environment::gravity>, Vec3d(0, -1.6, 0));
    EXPECT_EQ(scene.handler.gravity(), Vec3d(0, -1.6, 0));
    EXPECT_EQ(scene.handler.generation(), generation);
    scene.place(bearer, ObjectId{});
    EXPECT_EQ(scene.handler.gravity(), Vec3d(7, 7, 7));
}

}  // namespace
}  // namespace tessera
