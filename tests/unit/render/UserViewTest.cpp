// What depends on who looks: levels of detail, what turns towards a head, and lights among them. Histories of all that:
// SceneHistoryTest.
#include <cmath>
#include <limits>
#include <random>

#include "client/render/scene/SceneItems.h"
#include "client/render/scene/ShadowCasters.h"
#include "common/cores/Billboard.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/PointLight.h"
#include "common/cores/Switch.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Into any frame: +Z on the line to the head, or in the plane of it and the axis; a turn and nothing else.
TEST(TurnTowards, BringsZTowardsTheHeadInAnyFrame) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> number(-3, 3);
    const auto any = [&] { return Vec3d(number(random), number(random), number(random)); };
    int faced = 0;
    for (int i = 0; i < 20000; ++i) {
        Affine3d world_T_node = Affine3d::Identity();
        world_T_node.linear() << any(), any(), any();
        world_T_node.translation() = std::exp2(number(random) * 5) * any();
        const double turned = std::abs(world_T_node.linear().determinant());
        if (turned < 0.5) continue;
        const Vec3d head = world_T_node.translation() + any(), axis = i % 2 ? any() : Vec3d::Zero();
        const Mat3d turn = turnTowards(head, axis, world_T_node);
        ASSERT_LT((turn.transpose() * turn - Mat3d::Identity()).norm(), 1e-12);
        ASSERT_GT(turn.determinant(), 0);
        const Vec3d away = world_T_node.linear().inverse() * (head - world_T_node.translation());
        if (i % 2) {
            ASSERT_LT((turn * axis - axis).norm(), 1e-12 * axis.norm());
            // What of +Z and of the head is across the axis points the same way.
            const Vec3d z = axis.cross(turn.col(2)), h = axis.cross(away);
            if (z.norm() < 1e-3 || h.norm() < 1e-3) continue;
            ASSERT_LT((z.normalized() - h.normalized()).norm(), 1e-9);
        } else {
            ASSERT_LT((turn.col(2) - away.normalized()).norm(), 1e-12);
            ASSERT_GT(turn.col(1).y(), -1e-12) << "+Y stays up";
            ASSERT_LT(std::abs(turn.col(0).y()), 1e-12) << "and as far as that allows";
            // In the world too.
            ASSERT_LT((world_T_node.linear() * turn.col(2))
                          .normalized()
                          .cross((head - world_T_node.translation()).normalized())
                          .norm(),
                      1e-9);
        }
        ++faced;
    }
    EXPECT_GT(faced, 10000);
}

TEST(TurnTowards, LeavesAsItIsWhatNothingSaysHowToTurn) {
    const Affine3d plain = Affine3d::Identity();
    Affine3d flat = plain, lost = plain;
    flat.linear()(1, 1) = 0;
    lost.translation().x() = kNaN;
    const Mat3d unturned = Mat3d::Identity();
    EXPECT_EQ(turnTowards(Vec3d::Zero(), Vec3d::UnitY(), plain), unturned) << "at the origin";
    EXPECT_EQ(turnTowards(Vec3d::Zero(), Vec3d::Zero(), plain), unturned);
    EXPECT_EQ(turnTowards(Vec3d(0, 5, 0), Vec3d::UnitY(), plain), unturned) << "on the axis";
    EXPECT_EQ(turnTowards(Vec3d(1, 5, 0), Vec3d::UnitZ(), plain), unturned) << "+Z is the axis";
    EXPECT_EQ(turnTowards(Vec3d(1, 5, 0), Vec3d::UnitY(), flat), unturned);
    EXPECT_EQ(turnTowards(Vec3d(1, 5, 0), Vec3d::Zero(), lost), unturned);
    EXPECT_EQ(turnTowards(Vec3d(kNaN, 5, 0), Vec3d::UnitY(), plain), unturned);
    EXPECT_EQ(turnTowards(Vec3d(1e308, 1e308, 0), Vec3d(1e308, 1e308, 1e308), plain), unturned);
    // Straight above a point: +Y cannot stay up, so +X stays.
    const Mat3d above = turnTowards(Vec3d(0, 5, 0), Vec3d::Zero(), plain);
    EXPECT_EQ(above.col(0), Vec3d(Vec3d::UnitX()));
    EXPECT_EQ(above.col(2), Vec3d(Vec3d::UnitY()));
}

/// A thing with three levels before the eye, of which users see what `levels` says.
struct LevelsScene {
    TestScene scene;
    RenderScene all;
    ObjectId lod;
    std::vector<ObjectId> leaves;

    explicit LevelsScene(std::uint64_t levels) {
        const ObjectId core = scene.create(typeOf<DistanceLOD>());
        lod = scene.node(core, scene.node(scene.transform({0, 0, -6})));
        for (int i = 0; i < 3; ++i) leaves.push_back(scene.node(scene.geometry(makeSphere(0.6, 8 + 4 * i)), lod));
        setField<&Node::levels>(scene.edit, lod, static_cast<std::int64_t>(levels));
        scene.apply();
        all.update(scene.aspect, nullptr);
    }
    [[nodiscard]] std::vector<ObjectId> seenBy(unsigned user, CullerKind culler = CullerKind::kFrustum) {
        const TestCamera wall;
        ScreenCamera camera = wall.camera();
        camera.user = user;
        return nodesOf(RenderAction(culler).run(all, camera, wall.tile(), nullptr).opaque);
    }
};

TEST(UserView, EachUserSeesTheirLevelWithEveryCuller) {
    LevelsScene stage(0x0201020100020100);
    for (const CullerKind culler : kAllCullers) {
        if (asksRenderer(culler)) continue;
        for (unsigned user = 0; user < 10; ++user) {
            const std::size_t level = std::array{0, 1, 2, 0, 1, 2, 1, 2}[user % 8];
            EXPECT_EQ(stage.seenBy(user, culler), std::vector{stage.leaves[level]})
                << nameOf(culler) << ", user " << user;
        }
    }
}

TEST(UserView, WhereAllSeeTheSameNothingElseIsThere) {
    LevelsScene stage(0x0101010101010101);
    EXPECT_EQ(stage.all.impl().items.size(), 1u) << "the finest is made ready for nobody";
    EXPECT_EQ(stage.seenBy(3), std::vector{stage.leaves[1]});
    // Beyond the children: the last of them.
    setField<&Node::levels>(stage.scene.edit, stage.lod, std::int64_t{-1});
    const ChangeList list = stage.scene.apply();
    stage.all.update(stage.scene.aspect, &list);
    EXPECT_EQ(stage.seenBy(0), std::vector{stage.leaves[2]});
}

TEST(UserView, WhatAUserDoesNotSeeCastsNoShadowForThem) {
    LevelsScene stage(0x0202020202020100);
    const ObjectId sun = stage.scene.create(typeOf<DirectionalLight>());
    setField<&DirectionalLight::shadows>(stage.scene.edit, sun, true);
    stage.scene.node(sun);
    const ChangeList list = stage.scene.apply();
    stage.all.update(stage.scene.aspect, &list);
    const TestCamera wall;
    ScreenCamera camera = wall.camera();
    for (unsigned user = 0; user < 3; ++user) {
        camera.user = user;
        const DrawList drawn = RenderAction(CullerKind::kFrustum).run(stage.all, camera, wall.tile(), nullptr);
        ASSERT_TRUE(drawn.casters && drawn.casters->views.size() == 1);
        ASSERT_EQ(itemsOf(*drawn.casters->views[0]).size(), 1u);
        EXPECT_EQ(itemsOf(*drawn.casters->views[0])[0].node, stage.leaves[user]);
    }
}

// Both eyes and all screens of a user: one pose, by their head alone.
TEST(UserView, BillboardsFaceTheHeadAndNotTheEye) {
    TestScene scene;
    const ObjectId core = scene.create(typeOf<Billboard>());
    const ObjectId sign = scene.node(core, scene.node(scene.transform({1, 0, -6})));
    const ObjectId plate =
        scene.node(scene.geometry(makeBox({1, 1, 0.1})), scene.node(scene.transform({0, 0, 0.5}), sign));
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    TestCamera wall;
    wall.user.eyeSeparationMetres = 0.4;
    const auto poseFrom = [&](Eye eye) {
        const RenderScene::Impl& seen = all.seenFrom(wall.camera(eye));
        EXPECT_EQ(seen.items[0].node, plate);
        EXPECT_TRUE(seen.boxes[0].contains(seen.items[0].world_T_item.translation()));
        EXPECT_EQ(seen.tree.bounds().lower, seen.boxes[0].lower) << "the tree holds what has turned";
        return seen.items[0].world_T_item;
    };
    const Affine3d left = poseFrom(Eye::kLeft);
    EXPECT_EQ(left.matrix(), poseFrom(Eye::kRight).matrix());
    const Vec3d head = wall.camera().headWorld, origin(1, 0, -6);
    const Vec3d towards = Vec3d(head.x() - origin.x(), 0, head.z() - origin.z()).normalized();
    EXPECT_LT((left.linear().col(2) - towards).norm(), 1e-12);
    EXPECT_LT((left.translation() - (origin + 0.5 * towards)).norm(), 1e-12)
        << "all that is below turns about the node's origin";
    wall.user.position.x() += 1;
    EXPECT_GT((poseFrom(Eye::kCenter).linear() - left.linear()).norm(), 0.01);
    wall.user.position.x() -= 1;
    EXPECT_EQ(left.matrix(), poseFrom(Eye::kCenter).matrix()) << "wherever the head has been";
    // The axis is taken away: towards a point; then it is a plain group.
    setField<&Billboard::axis>(scene.edit, core, Vec3d(Vec3d::Zero()));
    wall.user.position.y() += 1;
    ChangeList list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_GT(poseFrom(Eye::kCenter).linear().col(2).y(), 0.05);
    setField<&Node::core>(scene.edit, sign, ObjectId());
    list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_EQ(poseFrom(Eye::kCenter).linear(), Mat3d(Mat3d::Identity()));
}

TEST(UserView, LightsAreThoseThatTheUserSeesAndThatAreOn) {
    TestScene scene;
    const ObjectId lod = scene.node(scene.create(typeOf<DistanceLOD>()));
    std::vector<ObjectId> lamps;
    for (int i = 0; i < 2; ++i) {
        lamps.push_back(scene.create(typeOf<PointLight>()));
        setField<&PointLight::intensity>(scene.edit, lamps.back(), static_cast<float>(i + 1));
        setField<&PointLight::attenuation>(scene.edit, lamps.back(), Vec3f(1, 2, 3));
        scene.node(lamps.back(), lod);
    }
    setField<&Node::levels>(scene.edit, lod, std::int64_t{0x0100});
    const ObjectId beacon = scene.node({}, scene.node(scene.transform({3, 4, 5})));
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    ScreenCamera camera = TestCamera().camera();
    const auto lightsFor = [&](unsigned user) {
        camera.user = user;
        return all.seenFrom(camera).lights;
    };
    ASSERT_EQ(lightsFor(0).size(), 1u);
    EXPECT_EQ(lightsFor(0)[0].radiance.x(), 1.0f);
    EXPECT_EQ(lightsFor(1)[0].radiance.x(), 2.0f);
    EXPECT_EQ(lightsFor(1)[0].attenuation, Vec3f(1, 2, 3));
    setField<&PointLight::beacon>(scene.edit, lamps[0], beacon);
    setField<&PointLight::on>(scene.edit, lamps[1], false);
    ChangeList list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_EQ(lightsFor(0)[0].position, Vec3d(3, 4, 5));
    EXPECT_TRUE(lightsFor(1).empty()) << "one that is off is no reason for the three of a scene without any";
    // Who is taken out of the scene is no beacon; who is hidden is one.
    scene.edit.detach(beacon);
    list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_EQ(lightsFor(0)[0].position, Vec3d(0, 0, 0));
    const ObjectId hidden = scene.create(typeOf<Switch>());
    setField<&Switch::choice>(scene.edit, hidden, Switch::kNone);
    scene.edit.place(beacon, scene.node(hidden, scene.node(scene.transform({0, 7, 0}))));
    list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_EQ(lightsFor(0)[0].position, Vec3d(0, 7, 0));
}

}  // namespace
}  // namespace tessera
