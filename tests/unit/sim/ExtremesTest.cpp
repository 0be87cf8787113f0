/// Numbers that a scene may hold and nobody means: the server goes on, says what it held back, and can take it back.
#include <gtest/gtest.h>

#include <limits>

#include "tests/fuzz/HostileShow.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::one;

constexpr double kFastest = CollisionObject::kFastest;
constexpr double kLargest = std::numeric_limits<double>::max();

bool namesTooFast(const FrameResult& frame) {
    return std::ranges::any_of(frame.collision.notLookedAt,
                               [](const NotLookedAt& n) { return n.reason == NotLookedAt::Reason::kTooFast; });
}

TEST(Extremes, ARotationTooLongToBeNormalisedIsRefused) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({test::craneScene()}));
    (void)simulation.step(true, {});
    const ObjectId crane = test::transformAt(simulation.scene(), "/crane");
    for (const double length : {1e60, 1e160, kLargest, 1e-60, 0.0}) {
        ChangeListBuilder edit;
        setField<&Transform::rotation>(edit, crane, Quatd(length, 0, 0, 0));
        const FrameResult frame = simulation.step(false, one(edit.take()));
        EXPECT_FALSE(frame.outcomes.front().result) << length;
    }
    ChangeListBuilder edit;
    setField<&Transform::rotation>(edit, crane, Quatd(1e40, 0, 0, 0));
    EXPECT_TRUE(simulation.step(false, one(edit.take())).outcomes.front().result);
}

TEST(Extremes, ABodyThatFallsForEverFallsAtTheGreatestSpeedAndIsNamed) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({test::bodyScene(Vec3d(0, -9810, 0), Vec3d(0, -kFastest + 100, 0))}));
    (void)simulation.step(true, {});
    FrameResult frame;
    for (int i = 0; i < 5; ++i) frame = simulation.step(false, {});
    EXPECT_TRUE(namesTooFast(frame));
    const ObjectId object = simulation.scene().get<Node>(findNode(simulation.scene(), "/object").value())->core;
    EXPECT_EQ(simulation.scene().get<CollisionObject>(object)->velocity, Vec3d(0, -kFastest, 0));
    EXPECT_LT(test::placeOf(simulation.scene(), "/body").y(), -4.0 * kFastest / 60);
}

TEST(Extremes, AMotionThatJumpsBackDoesNotMakeABodyTooFast) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({test::bodyScene(Vec3d::Zero(), Vec3d::Zero(), {{0, 0, 0, 0}, {0.1, 20'000, 0, 0}})}));
    (void)simulation.step(true, {});
    bool named = false;
    for (int i = 0; i < 20; ++i) named = namesTooFast(simulation.step(false, {})) || named;
    EXPECT_TRUE(named);
}

TEST(Extremes, AStepBetweenTheFarthestPlacesThereAre) {
    for (const std::int64_t response : {Interest::kStop, Interest::kSlide, Interest::kRollback, Interest::kAsk}) {
        Simulation simulation;
        ASSERT_TRUE(simulation.load({test::craneScene()}));
        const ObjectId interest = simulation.scene().get<Node>(findNode(simulation.scene(), "/interest").value())->core;
        ChangeListBuilder edit;
        setField<&Interest::response>(edit, interest, response);
        (void)simulation.step(true, one(edit.take()));
        for (const double x : {kLargest, -kLargest, 0.0, -kLargest, 1e300})
            (void)simulation.step(false,
                                  one(test::moveTo(test::transformAt(simulation.scene(), "/crane"), Vec3d(x, x, -x))));
    }
}

// A chain near the depth limit is hung up elsewhere, in an order that is too deep on the way back.
TEST(Extremes, WhatWasPlacedCanBeTakenBackHoweverDeepItWasInBetween) {
    ListMaker make;
    std::vector<ObjectId> chain;
    for (int i = 0; i < 250; ++i) chain.push_back(make.node("", chain.empty() ? kRootNode : chain.back()));
    const ObjectId lone = make.node("lone", kRootNode);
    Simulation simulation;
    ASSERT_TRUE(simulation.load({make.builder.take()}));
    const StateHash before = simulation.scene().stateHash();
    const auto real = [](ObjectId placeholder) { return ObjectId(placeholder.value - kFirstPlaceholder + 2); };
    ChangeListBuilder edit;
    edit.place(real(lone), real(chain.back()));
    edit.place(real(chain[5]), kRootNode);
    edit.place(real(chain[0]), real(lone));
    FrameResult frame = simulation.step(true, one(edit.take()));
    ASSERT_TRUE(frame.outcomes.front().result) << frame.outcomes.front().result.error().message;
    frame = simulation.step(false, one(Edit::Kind::kUndo));
    ASSERT_TRUE(frame.outcomes.front().result) << frame.outcomes.front().result.error().message;
    EXPECT_EQ(simulation.scene().stateHash(), before);
}

TEST(Extremes, ACameraOutOfThisWorldIsToldInWords) {
    Aspect scene;
    ChangeListBuilder list;
    const ObjectId far{2}, place{3}, camera{4}, core{5};
    list.create(far, typeOf<Node>());
    list.create(place, typeOf<Transform>());
    list.create(camera, typeOf<Node>());
    list.create(core, typeOf<Camera>());
    list.place(far, kRootNode);
    list.place(camera, far);
    setField<&Node::core>(list, far, place);
    setField<&Node::core>(list, camera, core);
    ASSERT_TRUE(scene.apply(list.take()));
    ViewSource view(test::wallOfOne(), "");
    view.update(scene, nullptr);
    ASSERT_TRUE(view.view(scene));
    for (const Vec3d& translation : {Vec3d(1.7e308, 0, 0), Vec3d(0, 1e200, 0), Vec3d(0, 0, -1e16)}) {
        setField<&Transform::translation>(list, place, translation);
        setField<&Transform::scale>(list, place, Vec3d(1.7e308, 1, 1));
        const ChangeList edit = list.take();
        ASSERT_TRUE(scene.apply(edit));
        view.update(scene, &edit);
        const Expected<View> now = view.view(scene);
        ASSERT_FALSE(now);
        EXPECT_WORDS(now.error().message);
    }
}

TEST(Extremes, NothingThatEditsSayEndsTheSimulation) {
    test::HostileCounts counts;
    forSeeds(1000, [&](Random& random) {
        const std::string wrong = test::hostileShow([&](std::size_t n) { return below(random, n); }, 40, counts);
        ASSERT_EQ(wrong, "");
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(counts.taken, 300u);
    EXPECT_GT(counts.refused, 300u);
    EXPECT_GT(counts.undone, 50u);
}

}  // namespace
}  // namespace tessera
