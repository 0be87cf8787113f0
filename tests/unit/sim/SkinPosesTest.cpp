/// Poses of skins: beside the matrices of the whole scene after random histories; what travels, what costs nothing,
/// what cannot be said.
#include "common/cores/Skin.h"
#include "server/sim/frame/SkinPoses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/codec/ChangeCodec.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::one;

constexpr std::size_t kManyJoints = 50;

/// /carrier carries /carrier/figure/j0/j1/… and /carrier/skin; each vertex of the box follows a joint.
struct Figure {
    ListMaker make;
    std::vector<ObjectId> joints, places;
    ObjectId skin, carrierPlace, bearerPlace;

    explicit Figure(std::size_t count) {
        carrierPlace = make.transform(Vec3d(1, 2, 3));
        const ObjectId carrier = make.node("carrier", kRootNode, carrierPlace);
        ObjectId above = make.node("figure", carrier, make.transform(Vec3d(0, 1, 0)));
        for (std::size_t j = 0; j < count; ++j) {
            places.push_back(make.transform(Vec3d(0.1, 0, 0)));
            joints.push_back(above = make.node("j" + std::to_string(j), above, places.back()));
        }
        skin = make.create<Skin>();
        const MeshArrays box = makeBox(Vec3d::Ones()).toArrays();
        const std::size_t vertices = box.positions.sizeBytes() / 12;
        std::vector<std::uint16_t> indices;
        std::vector<float> weights, binds;
        for (std::size_t k = 0; k < 4 * vertices; ++k)
            indices.push_back(static_cast<std::uint16_t>(k % count)), weights.push_back(k % 4 == 0);
        for (std::size_t j = 0; j < count; ++j)
            for (const double number :
                 {1.0, 0.0, 0.0, -0.1 * static_cast<double>(j), 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0})
                binds.push_back(static_cast<float>(number));
        setField<&Skin::positions>(make.builder, skin, box.positions);
        setField<&Skin::normals>(make.builder, skin, box.normals);
        setField<&Skin::indices>(make.builder, skin, box.indices);
        setField<&Skin::jointIndices>(make.builder, skin, Blob::of(std::span<const std::uint16_t>(indices)));
        setField<&Skin::jointWeights>(make.builder, skin, Blob::of(std::span<const float>(weights)));
        setField<&Skin::inverseBinds>(make.builder, skin, Blob::of(std::span<const float>(binds)));
        setField<&Skin::joints>(make.builder, skin, joints);
        bearerPlace = make.transform(Vec3d(5, 0, 0));
        make.node("skin", make.node("bearer", carrier, bearerPlace), skin);
    }
};

ObjectId realId(ObjectId placeholder) {
    return ObjectId(placeholder.value - kFirstPlaceholder + 2);
}

Simulation standing(Figure& figure) {
    Simulation simulation;
    const Expected<CommittedFrame> frame = simulation.load({figure.make.builder.take()});
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    return simulation;
}

/// By world matrices of the whole way up.
void expectRight(const Simulation& simulation, ObjectId skinId) {
    const Aspect& scene = simulation.scene();
    const Skin& skin = *scene.get<Skin>(skinId);
    const Affine3d world_T_bearer = worldTransform(scene, findNode(scene, "/carrier/bearer/skin").value());
    const auto pose = skin.pose.as<float>(), binds = skin.inverseBinds.as<float>();
    ASSERT_EQ(pose.size(), skin.joints.size() * 12);
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
        Affine3d bind = Affine3d::Identity();
        for (Eigen::Index i = 0; i < 12; ++i)
            bind(i / 4, i % 4) = static_cast<double>(binds[12 * j + static_cast<std::size_t>(i)]);
        const Affine3d right = world_T_bearer.inverse() * worldTransform(scene, skin.joints[j]) * bind;
        for (Eigen::Index i = 0; i < 12; ++i)
            ASSERT_NEAR(pose[12 * j + static_cast<std::size_t>(i)], right(i / 4, i % 4),
                        1e-5 * (1 + std::abs(right(i / 4, i % 4))))
                << "joint " << j;
    }
}

ChangeList turned(ObjectId place, double angle) {
    ChangeListBuilder builder;
    setField<&Transform::rotation>(builder, place, Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitZ())));
    return builder.take();
}

TEST(SkinPoses, AreRightFromTheFirstFrameAndFollowJointsAndBearer) {
    Figure figure(5);
    Simulation simulation = standing(figure);
    (void)simulation.step(true, {});
    expectRight(simulation, realId(figure.skin));
    for (const ObjectId place : {figure.places[2], figure.places[0], figure.bearerPlace}) {
        (void)simulation.step(false, one(turned(realId(place), 0.7)));
        expectRight(simulation, realId(figure.skin));
    }
}

TEST(SkinPoses, OnlyWhatMovedTravelsAndWhoIsCarriedAwayAsAWholeCostsNothing) {
    Figure figure(kManyJoints);
    Simulation simulation = standing(figure);
    (void)simulation.step(true, {});
    const std::uint64_t calculated = simulation.skinPoses().calculated();
    const FrameResult carried = simulation.step(false, one(turned(realId(figure.carrierPlace), 0.3)));
    EXPECT_TRUE(carried.commit.list->ranges.empty()) << "bearer and joints go together";
    EXPECT_EQ(simulation.skinPoses().calculated(), calculated);
    const FrameResult last = simulation.step(false, one(turned(realId(figure.places[kManyJoints - 1]), 0.3)));
    ASSERT_EQ(last.commit.list->ranges.size(), 1u);
    EXPECT_EQ(last.commit.list->ranges[0].offset, (kManyJoints - 1) * 48);
    EXPECT_EQ(last.commit.list->ranges[0].bytes.sizeBytes(), 48u);
    EXPECT_EQ(simulation.skinPoses().calculated(), calculated + 1);
    (void)simulation.step(false, {});
    EXPECT_EQ(simulation.skinPoses().calculated(), calculated + 1) << "a frame in which nothing moves";
    // All joints turn: what they cost themselves, and their pose.
    ChangeListBuilder all;
    for (const ObjectId place : figure.places)
        setField<&Transform::rotation>(all, realId(place), Quatd(Eigen::AngleAxisd(0.02, Vec3d::UnitY())));
    const FrameResult moved = simulation.step(false, one(all.take()));
    ASSERT_EQ(moved.commit.list->ranges.size(), 1u);
    EXPECT_LT(moved.commit.sent->encoded.size(), kManyJoints * (48 + 40 + 16) + 256)
        << "a matrix, a rotation and an id each";
    RecordProperty("bytes of a frame in which 50 joints turn", static_cast<int>(moved.commit.sent->encoded.size()));
}

TEST(SkinPoses, ABearerScaledToNothingLeavesThePoseAndSaysSoOnce) {
    Figure figure(3);
    Simulation simulation = standing(figure);
    (void)simulation.step(true, {});
    const Blob before = simulation.scene().get<Skin>(realId(figure.skin))->pose;
    const auto scaled = [&](double scale) {
        ChangeListBuilder builder;
        setField<&Transform::scale>(builder, realId(figure.bearerPlace), Vec3d::Constant(scale));
        return simulation.step(false, one(builder.take()));
    };
    const FrameResult crushed = scaled(1e-20);
    ASSERT_EQ(simulation.scene().get<Transform>(realId(figure.bearerPlace))->scale, Vec3d(1e-20, 1e-20, 1e-20));
    ASSERT_EQ(crushed.remarks.size(), 1u);
    EXPECT_WORDS(crushed.remarks[0]);
    EXPECT_EQ(simulation.scene().get<Skin>(realId(figure.skin))->pose, before);
    EXPECT_TRUE(simulation.step(false, one(turned(realId(figure.places[0]), 0.2))).remarks.empty());
    (void)scaled(2);
    expectRight(simulation, realId(figure.skin));
}

TEST(SkinPoses, JointsThatAreNotAsManyAsThePoseAreRefusedByName) {
    Figure figure(4);
    Simulation simulation = standing(figure);
    (void)simulation.step(true, {});
    ChangeListBuilder fewer;
    setField<&Skin::joints>(fewer, realId(figure.skin), RefList{realId(figure.joints[0])});
    const Expected<answer::Committed> result = simulation.step(false, one(fewer.take())).outcomes.front().result;
    ASSERT_FALSE(result);
    EXPECT_WORDS(result.error().message);
}

TEST(SkinPoses, AfterAnyHistoryTheyAreWhatTheWholeSceneSays) {
    forSeeds(40, [&](Random& random) {
        Figure figure(4);
        Simulation simulation = standing(figure);
        (void)simulation.step(true, {});
        std::vector<ObjectId> places = figure.places;
        places.insert(places.end(), {figure.carrierPlace, figure.bearerPlace});
        const auto path = [&](const char* text) { return findNode(simulation.scene(), text).value(); };
        for (int step = 0; step < 25; ++step) {
            ChangeListBuilder builder;
            const ObjectId place = realId(places[below(random, places.size())]);
            const std::size_t what = below(random, 6);
            if (what == 0)
                setField<&Transform::translation>(builder, place, Vec3d(static_cast<double>(below(random, 9)), 1, 0));
            if (what == 1)
                setField<&Transform::scale>(builder, place, Vec3d(1, 1 + static_cast<double>(below(random, 3)), 2));
            if (what == 2)
                setField<&Transform::rotation>(
                    builder, place,
                    Quatd(Eigen::AngleAxisd(static_cast<double>(below(random, 60)) / 10, Vec3d(1, 2, 3).normalized())));
            if (what == 3)
                builder.place(path("/carrier/figure"), oneIn(random, 2) ? path("/carrier/bearer") : path("/carrier"));
            if (what == 4) {
                // Another node bears the skin too; the lowest counts.
                const ObjectId node(kFirstPlaceholder);
                builder.create(node, typeOf<Node>());
                setField<&Node::core>(builder, node, realId(figure.skin));
                builder.place(node, path("/carrier"));
            }
            const bool back = what == 5 && oneIn(random, 2);
            // A figure below the bearer is found elsewhere.
            FrameResult frame;
            if (back || builder.empty())
                frame = simulation.step(false, one(Edit::Kind::kUndo));
            else
                frame = simulation.step(false, one(builder.take()));
            if (!findNode(simulation.scene(), "/carrier/figure")) {
                ChangeListBuilder home;
                home.place(path("/carrier/bearer/figure"), path("/carrier"));
                expectRight(simulation, realId(figure.skin));
                (void)simulation.step(false, one(home.take()));
            }
            expectRight(simulation, realId(figure.skin));
            if (testing::Test::HasFailure()) return;
        }
    });
}

}  // namespace
}  // namespace tessera
