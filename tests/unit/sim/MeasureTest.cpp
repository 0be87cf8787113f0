// How far it is from a place: asked as applications ask it.
#include <gtest/gtest.h>

#include "common/scene/FieldTable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class Measure : public test::DeskStage {
protected:
    Expected<answer::Measured> ask(const request::MeasureDistance& wish) {
        server.forget();
        server.take(desk.received({application, "somebody", 1, share(encodeRequest(wish))}, server.now));
        const auto replies = server.sent<message::Reply>(application);
        EXPECT_EQ(replies.size(), 1u);
        if (!replies.at(0).error.empty()) return fail(replies[0].code, replies[0].error);
        return std::get<answer::Measured>(decodeAnswer(replies[0].body).value());
    }

    RequestDesk desk{surroundings()};
    ConnectionId application = server.hello("somebody", PeerRole::kApplication);
};

TEST_F(Measure, FromPlaceToPlaceIsTheLengthBetweenThem) {
    const auto told = ask({.from = Vec3d(1, 2, 3), .to = Vec3d(1, 5, 7)});
    ASSERT_TRUE(told) << told.error().message;
    EXPECT_EQ(told->distance, 5);
    EXPECT_EQ(told->from, Vec3d(1, 2, 3));
    EXPECT_EQ(told->to, Vec3d(1, 5, 7));
    EXPECT_FALSE(told->node);
    EXPECT_NEAR(ask({.from = Vec3d(-1e300, 0, 0), .to = Vec3d(1e300, 0, 0)})->distance / 2e300, 1, 1e-15);
    const auto beyond = ask({.from = Vec3d(-1e308, 0, 0), .to = Vec3d(1e308, 0, 0)});
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().code, ErrorCode::kBadInput);
    EXPECT_WORDS(beyond.error().message);
}

TEST_F(Measure, FromPlaceToNodeEndsAtWhatIsSeenOfIt) {
    ASSERT_TRUE(simulation.load({test::craneScene(false)}));
    const Aspect& scene = simulation.scene();
    const ObjectId bricks = findNode(scene, "/wall/bricks").value();
    const Vec3d place(1, 0.5, 0.25);
    for (const std::string path : {"/wall", "/wall/bricks"}) {
        const auto told = ask({.from = place, .node = findNode(scene, path).value()});
        ASSERT_TRUE(told) << told.error().message;
        EXPECT_DOUBLE_EQ(told->distance, 2.5);
        EXPECT_EQ(told->error, 0);
        EXPECT_EQ(told->node, bricks);
        EXPECT_TRUE(told->to.isApprox(Vec3d(3.5, 0.5, 0.25)));
        EXPECT_TRUE(told->normal.isApprox(-Vec3d::UnitX()));
    }
    EXPECT_DOUBLE_EQ(ask({.from = place, .node = kRootNode})->distance, 0.5) << "the hook is nearer";
}

TEST_F(Measure, WhatCannotBeToldIsSaidInWords) {
    ASSERT_TRUE(simulation.load({test::craneScene(false)}));
    const Aspect& scene = simulation.scene();
    const auto nowhere = ask({.from = Vec3d::Zero(), .node = ObjectId{4711}});
    EXPECT_EQ(nowhere.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(nowhere.error().message);
    const auto empty = ask({.from = Vec3d::Zero(), .node = findNode(scene, "/motion").value()});
    EXPECT_EQ(empty.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(empty.error().message);
    EXPECT_EQ(ask({.from = Vec3d::Zero()}).error().code, ErrorCode::kBadInput) << "neither a place nor a node";
    EXPECT_EQ(ask({.from = Vec3d::Zero(), .to = Vec3d::Ones(), .node = kRootNode}).error().code, ErrorCode::kBadInput);
}

}  // namespace
}  // namespace tessera
