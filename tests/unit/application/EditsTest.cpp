#include "common/scene/Edits.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using test::craneScene;
using test::kCrane;
using test::kCraneCore;
using test::kHall;
using test::kHook;

class Edits : public testing::Test {
protected:
    Edits() { EXPECT_TRUE(scene.apply(craneScene())); }
    const Transform& crane() { return *scene.get<Transform>(kCraneCore); }
    void apply(const Expected<ChangeList>& list) {
        ASSERT_TRUE(list) << list.error().message;
        const auto applied = scene.apply(*list);
        ASSERT_TRUE(applied) << applied.error().message;
    }
    Aspect scene;
};

TEST_F(Edits, MovingANodeMovesTheNearestTransformAboveIt) {
    EXPECT_EQ(*movableNode(scene, kCrane), kCrane);
    EXPECT_EQ(*movableNode(scene, kHook), kCrane);
    apply(moveList(scene, kHook, {.translation = Vec3d(7, 8, 9)}));
    EXPECT_EQ(crane().translation, Vec3d(7, 8, 9));
    const auto refused = moveList(scene, kHall, {.translation = Vec3d(7, 8, 9)});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(refused.error().message);
}

TEST_F(Edits, ARelativeMoveStartsFromWhatIsThere) {
    const Quatd quarter(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitY()));
    apply(moveList(scene, kCrane,
                   {.translation = Vec3d(1, 0, 0), .rotation = quarter, .scale = Vec3d(2, 2, 2), .relative = true}));
    apply(moveList(scene, kCrane,
                   {.translation = Vec3d(1, 0, 0), .rotation = quarter, .scale = Vec3d(2, 2, 2), .relative = true}));
    EXPECT_EQ(crane().translation, Vec3d(3, 2, 3));
    EXPECT_LT(crane().rotation.angularDistance(Quatd(Eigen::AngleAxisd(std::numbers::pi, Vec3d::UnitY()))), 1e-12);
    EXPECT_EQ(crane().scale, Vec3d(4, 4, 4));
    apply(moveList(scene, kCrane, {.rotation = Quatd(0, 0, 5, 0)}));
    EXPECT_EQ(crane().translation, Vec3d(3, 2, 3)) << "what is not set stays";
    EXPECT_NEAR(crane().rotation.norm(), 1, 1e-12);
}

TEST_F(Edits, AMoveThatSaysNothingOrTurnsAroundNothingIsRefused) {
    EXPECT_EQ(moveList(scene, kCrane, {}).error().code, ErrorCode::kUsage);
    EXPECT_EQ(moveList(scene, kCrane, {.rotation = Quatd(0, 0, 0, 0)}).error().code, ErrorCode::kUsage);
    EXPECT_EQ(moveList(scene, kCrane, {.scale = Vec3d(1, 0, 1)}).error().code, ErrorCode::kUsage);
    EXPECT_EQ(moveList(scene, ObjectId{999}, {.translation = Vec3d::Zero()}).error().code, ErrorCode::kNotFound);
}

TEST_F(Edits, RemovingANodeTakesEverythingThatOnlyItUsed) {
    apply(removalList(scene, kHall));
    EXPECT_EQ(scene.objectCount(), Aspect().objectCount());
    EXPECT_TRUE(scene.root().children.empty());
}

TEST_F(Edits, WhatOthersUseStaysWhenANodeIsRemoved) {
    const ObjectId other{50};
    ChangeListBuilder edits;
    edits.create(other, typeOf<Node>());
    edits.place(other, kRootNode);
    edits.set(other, typeOf<Node>(), fieldId<&Node::core>, toValue(test::kHookCore));
    apply(edits.take());
    apply(removalList(scene, kHall));
    EXPECT_TRUE(scene.find(test::kHookCore)) << "a core that another node shares";
    EXPECT_TRUE(scene.find(test::kMetal)) << "and the material of that core";
    EXPECT_FALSE(scene.find(kCraneCore));
    apply(removalList(scene, other));
    EXPECT_EQ(scene.objectCount(), Aspect().objectCount());
}

TEST_F(Edits, TheRootStays) {
    EXPECT_EQ(removalList(scene, kRootNode).error().code, ErrorCode::kRefused);
    EXPECT_EQ(removalList(scene, ObjectId{999}).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace tessera
