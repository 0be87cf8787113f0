#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// A unit box at the origin and a wall of 10 × 10 whose near face stands at x = 5.
struct BoxAndWall : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    Body wall = body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    ObjectId wish = interest(box.node);

    TentativeTransform to(double x) { return {.transform = box.transform, .translation = Vec3d(x, 0, 0)}; }
    double x() { return at(box.transform).translation.x(); }
};

constexpr double kGap = 2e-4;  // stopTolerance times the box's diagonal, and a bit

TEST(Stop, ABoxComesToRestAtTheWall) {
    BoxAndWall scene;
    for (int frame = 0; frame < 100; ++frame) {
        const StepResult result = scene.frame({scene.to(scene.x() + 0.1)});
        EXPECT_LT(scene.x() + 0.5, 5.0);
        EXPECT_EQ(result.stopped.empty(), result.contacts.empty());
    }
    EXPECT_NEAR(scene.x() + 0.5, 5.0, kGap);
}

TEST(Stop, OneHugeStepDoesNotJumpTheWall) {
    BoxAndWall scene;
    const StepResult result = scene.frame({scene.to(1000)});
    EXPECT_EQ(result.stopped, std::vector{scene.box.transform});
    EXPECT_LT(scene.x() + 0.5, 5.0);
    EXPECT_NEAR(scene.x() + 0.5, 5.0, kGap);
}

TEST(Stop, ASmallSheetThatWouldEndUpInsideTheBoxStopsIt) {
    // No sampling of poses finds this one: before and after, no triangles meet.
    SceneMaker scene;
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(kRootNode, shapes::sheet(0.2, 0.2), Vec3d(2, 0, 0),
               Quatd(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitY())));
    scene.interest(box.node);
    for (const double end : {2.0, 2.3, 500.0}) {
        scene.commit({.transform = box.transform});
        const StepResult result = scene.frame({{.transform = box.transform, .translation = Vec3d(end, 0, 0)}});
        EXPECT_EQ(result.stopped.size(), 1u);
        EXPECT_NEAR(scene.at(box.transform).translation.x(), 1.5, kGap);
        EXPECT_FALSE(result.contacts.empty());
    }
}

TEST(Stop, ReportsWhatStoppedItAndKeepsDoingSoWhilePressed) {
    BoxAndWall scene;
    scene.frame({scene.to(4)});
    for (int frame = 0; frame < 5; ++frame) {
        const StepResult result = scene.frame({scene.to(6)});
        ASSERT_FALSE(result.contacts.empty());
        EXPECT_EQ(result.contactsBegun, frame == 0 ? 1u : 0u);
        for (const Contact& c : result.contacts) {
            EXPECT_EQ(c.objectA, scene.box.shape);
            EXPECT_EQ(c.objectB, scene.wall.shape);
            EXPECT_NEAR(c.point.x(), 5.0, kGap);
            EXPECT_LE(std::abs(c.point.y()), 0.5 + kGap);
            EXPECT_LE(std::abs(c.point.z()), 0.5 + kGap);
            EXPECT_NEAR((c.normal - Vec3d::UnitX()).norm(), 0, 1e-9) << c.normal.transpose();
        }
    }
    const StepResult away = scene.frame({scene.to(3)});
    EXPECT_TRUE(away.stopped.empty());
    EXPECT_TRUE(away.contacts.empty());
    EXPECT_EQ(scene.x(), 3.0);
}

TEST(Stop, WhatIsPressedForLongIsToldAsOften) {
    // The same stop again is the same contact: a list that kept every one made a frame slower for as long as it ran.
    CollisionLimits limits;
    limits.maxContacts = 1;
    SceneMaker scene(limits);
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    scene.interest(box.node);
    const TentativeTransform push{.transform = box.transform, .translation = Vec3d(6, 0, 0)};
    scene.frame({push});
    const std::uint64_t once = scene.frame({push}).counters.contactsLeftOut;
    EXPECT_GT(once, 0u) << "several pairs of faces stop it, one is listed";
    for (int frame = 0; frame < 300; ++frame) ASSERT_EQ(scene.frame({push}).counters.contactsLeftOut, once) << frame;
}

TEST(Stop, ATurningBeamStopsAtThePostWithoutPassingIt) {
    // A beam of length 4 turns about z in one step of nearly half a turn; a thin post stands in the quarter.
    SceneMaker scene;
    const auto beam = scene.body(kRootNode, shapes::box(Vec3d(4, 0.1, 0.1)), Vec3d::Zero());
    scene.body(kRootNode, shapes::box(Vec3d(0.02, 0.02, 3)), Vec3d(0, 1.5, 0));
    scene.interest(beam.node);
    const auto turned = [&](double angle) {
        return TentativeTransform{.transform = beam.transform,
                                  .rotation = Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitZ()))};
    };
    const StepResult result = scene.frame({turned(3.0)});
    ASSERT_EQ(result.stopped.size(), 1u);
    const double reached = scene.at(beam.transform).rotation.angularDistance(Quatd::Identity());
    // The beam's upper side meets the post's lower right corner (0.01, 1.49): at angle a its distance from the beam's
    // axis, 0.01·sin(a) - 1.49·cos(a) turned around, is half the thickness.
    const double expected = std::atan2(1.49, 0.01) - std::asin(0.05 / std::hypot(0.01, 1.49));
    EXPECT_LT(reached, expected + 1e-9);
    EXPECT_NEAR(reached, expected, 1e-3);
}

TEST(Stop, IsAnEventThatStaysWhileBothStay) {
    BoxAndWall scene;
    const StepResult stopped = scene.frame({scene.to(1000)});
    ASSERT_EQ(stopped.events.size(), 1u);
    EXPECT_EQ(stopped.events.front().phase, Phase::kBegan);
    EXPECT_NEAR(stopped.events.front().firstTime, 0.0045, 1e-4);
    EXPECT_NEAR(stopped.events.front().point.x(), 5, 1e-3);
    EXPECT_EQ(stopped.contactsBegun, 1u);
    // Nobody pushes any more; another stop elsewhere does not make it forgotten, nor does a change of structure.
    const auto other = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 20, 0));
    scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(3, 20, 0));
    scene.interest(other.node);
    const StepResult later = scene.frame({{.transform = other.transform, .translation = Vec3d(9, 20, 0)}});
    EXPECT_EQ(later.contactsBegun, 1u);
    ASSERT_EQ(later.events.size(), 2u);
    EXPECT_EQ(later.events.front().phase, Phase::kStays);
    EXPECT_EQ(later.events.back().phase, Phase::kBegan);
    ASSERT_FALSE(later.contacts.empty());
    EXPECT_EQ(later.contacts.front().objectA, scene.box.shape);
    EXPECT_NEAR(later.contacts.front().time, 0.0045, 1e-4) << "as when it was stopped";
    const StepResult away = scene.frame({scene.to(0)});
    EXPECT_EQ(away.events.front().phase, Phase::kEnded);
    EXPECT_EQ(away.events.back().phase, Phase::kStays);
}

TEST(Stop, AGrowingBoxStopsAtTheWall) {
    BoxAndWall scene;
    scene.frame({scene.to(4)});
    const StepResult result =
        scene.frame({{.transform = scene.box.transform, .translation = Vec3d(4, 0, 0), .scale = Vec3d(5, 1, 1)}});
    EXPECT_EQ(result.stopped.size(), 1u);
    EXPECT_NEAR(scene.at(scene.box.transform).scale.x(), 2.0, 1e-3);
    EXPECT_LT(scene.at(scene.box.transform).scale.x(), 2.0);
}

TEST(Stop, TheWallIsStoppedByTheBoxTheInterestIsIn) {
    BoxAndWall scene;
    const StepResult result = scene.frame({{.transform = scene.wall.transform, .translation = Vec3d(-3, 0, 0)}});
    EXPECT_EQ(result.stopped, std::vector{scene.wall.transform});
    // The tolerance is in sizes of what moves: here the wall.
    EXPECT_NEAR(scene.at(scene.wall.transform).translation.x(), 0.6,
                CollisionLimits().stopTolerance * Vec3d(0.2, 10, 10).norm());
    for (const Contact& c : result.contacts) {
        EXPECT_EQ(c.objectA, scene.box.shape) << "A is the interest's object, whoever moves";
        EXPECT_NEAR((c.normal - Vec3d::UnitX()).norm(), 0, 1e-9);
    }
}

TEST(Stop, OthersGoTheirWayUnhindered) {
    BoxAndWall scene;
    const auto other = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 20, 0));
    const ObjectId loose = scene.transform(Vec3d::Zero());
    const StepResult result = scene.frame({scene.to(9),
                                           {.transform = other.transform, .translation = Vec3d(7, 20, 1)},
                                           {.transform = loose, .translation = Vec3d(1, 2, 3)}});
    EXPECT_EQ(result.stopped, std::vector{scene.box.transform});
    EXPECT_EQ(scene.at(other.transform).translation, Vec3d(7, 20, 1));
    EXPECT_EQ(scene.at(loose).translation, Vec3d(1, 2, 3));
}

TEST(Stop, ThroughItsOwnKindNothingIsStoppedWithoutAnInterest) {
    BoxAndWall scene;
    const auto ghost = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, 3));
    // The ghost is in nobody's way but the box's: the box is against everything.
    const StepResult result = scene.frame({{.transform = ghost.transform, .translation = Vec3d(20, 0, 3)}});
    EXPECT_TRUE(result.stopped.empty()) << "through the wall";
    EXPECT_EQ(scene.frame({{.transform = ghost.transform, .translation = Vec3d(0, 0, 3)}}).stopped.size(), 0u);
    EXPECT_EQ(scene.frame({{.transform = ghost.transform, .translation = Vec3d(0, 0, -3)}}).stopped.size(), 1u);
}

TEST(Stop, AReportingInterestReportsAndLetsPass) {
    SceneMaker scene;
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    scene.interest(box.node, {}, Interest::kReport);
    const StepResult in = scene.frame({{.transform = box.transform, .translation = Vec3d(5, 0, 0)}});
    EXPECT_TRUE(in.stopped.empty());
    EXPECT_FALSE(in.contacts.empty());
    EXPECT_EQ(in.contactsBegun, 1u);
    const StepResult still = scene.frame({});
    EXPECT_EQ(still.contacts.size(), in.contacts.size());
    EXPECT_EQ(still.contactsBegun, 0u);
    EXPECT_EQ(still.counters.pairsTested, 0u) << "nothing moved, nothing is asked again";
    const StepResult out = scene.frame({{.transform = box.transform, .translation = Vec3d(9, 0, 0)}});
    EXPECT_TRUE(out.contacts.empty());
}

TEST(Stop, SeveralMoversGoInTheOrderOfTheirIds) {
    // Two boxes run at each other in one step; the one with the lower id goes first and gets all it wants.
    SceneMaker scene;
    const auto first = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(-3, 0, 0));
    const auto second = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(3, 0, 0));
    scene.interest(first.node);
    scene.interest(second.node);
    ASSERT_LT(first.transform, second.transform);
    const TentativeTransform one{.transform = first.transform, .translation = Vec3d(0.5, 0, 0)};
    const TentativeTransform two{.transform = second.transform, .translation = Vec3d(-0.5, 0, 0)};
    const StepResult result = scene.pipeline.step(scene.aspect, std::vector{two, one});
    EXPECT_EQ(result.stopped, std::vector{second.transform});
    ASSERT_EQ(result.accepted.size(), 2u);
    EXPECT_EQ(result.accepted[0].transform, first.transform);
    EXPECT_EQ(result.accepted[0].translation.x(), 0.5);
    EXPECT_NEAR(result.accepted[1].translation.x(), 1.5, kGap);
}

TEST(Stop, AConvoyUnderOneTransformDoesNotHinderItself) {
    // A trolley carries two boxes that touch; they ride along, and stop together at the wall.
    SceneMaker scene;
    const ObjectId trolley = scene.transform(Vec3d::Zero());
    const ObjectId trolleyNode = scene.node(kRootNode, trolley);
    const auto carried = scene.body(trolleyNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(trolleyNode, shapes::box(Vec3d::Ones()), Vec3d(-1, 0, 0));
    scene.body(kRootNode, shapes::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    scene.interest(carried.node);
    EXPECT_TRUE(scene.frame({{.transform = trolley, .translation = Vec3d(2, 0, 0), .rotation = Quatd(0.9, 0.1, 0, 0)}})
                    .stopped.empty());
    const StepResult result =
        scene.frame({{.transform = trolley, .translation = Vec3d(8, 0, 0), .rotation = Quatd(0.9, 0.1, 0, 0)}});
    EXPECT_EQ(result.stopped, std::vector{trolley});
    EXPECT_NEAR(scene.at(trolley).translation.x(), 4.5, kGap);
    // Pulled apart by its own transform, the carried one is stopped by its companion again.
    EXPECT_EQ(scene.frame({{.transform = carried.transform, .translation = Vec3d(-0.5, 0, 0)}}).stopped.size(), 1u);
}

TEST(Stop, NestedTransformsMoveAtOnce) {
    // A crane: bridge, trolley, hoist; all three move in one step, the load hits the floor.
    SceneMaker scene;
    const ObjectId bridge = scene.transform(Vec3d(0, 5, 0)), trolley = scene.transform(Vec3d::Zero());
    const ObjectId bridgeNode = scene.node(kRootNode, bridge);
    const ObjectId trolleyNode = scene.node(bridgeNode, trolley);
    const auto load = scene.body(trolleyNode, shapes::box(Vec3d::Ones()), Vec3d(0, -2, 0));
    scene.body(kRootNode, shapes::box(Vec3d(20, 0.2, 20)), Vec3d(0, -0.1, 0));
    scene.interest(load.node);
    const StepResult result = scene.frame({{.transform = bridge, .translation = Vec3d(0, 5, 3)},
                                           {.transform = trolley, .translation = Vec3d(2, 0, 0)},
                                           {.transform = load.transform, .translation = Vec3d(0, -7, 0)}});
    EXPECT_EQ(result.stopped, std::vector{load.transform});
    EXPECT_EQ(scene.at(bridge).translation.z(), 3);
    EXPECT_EQ(scene.at(trolley).translation.x(), 2);
    EXPECT_NEAR(scene.at(load.transform).translation.y(), -4.5, kGap);
    for (const Contact& c : result.contacts) {
        EXPECT_NEAR(c.point.y(), 0, kGap);
        EXPECT_NEAR((c.normal + Vec3d::UnitY()).norm(), 0, 1e-9) << "the floor would have to go down";
    }
}

TEST(Stop, WhatIsStuckCanBePulledOutButNotPushedDeeper) {
    BoxAndWall scene;
    scene.commit(scene.to(4.58));  // 0.08 deep, as an edit that asked nobody would leave it
    const StepResult before = scene.frame({});
    ASSERT_FALSE(before.contacts.empty());
    EXPECT_EQ(scene.frame({scene.to(4.5801)}).stopped.size(), 0u) << "no more faces meet than before";
    const StepResult deeper = scene.frame({scene.to(5.1)});
    EXPECT_EQ(deeper.stopped.size(), 1u) << "its back faces would come to meet the wall, too";
    EXPECT_LT(scene.x() + 0.5, 5.2);
    const StepResult out = scene.frame({scene.to(3)});
    EXPECT_TRUE(out.stopped.empty());
    EXPECT_TRUE(out.contacts.empty());
    EXPECT_EQ(scene.x(), 3.0);
}

/// A unit box that stands exactly on a floor of many triangles, as a scene's author would put it.
struct BoxOnFloor : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0.3, 0.5, 0.2));
    Body floor = body(kRootNode, tiles(), Vec3d::Zero());
    ObjectId wish = interest(box.node);

    static shapes::Soup tiles() {
        shapes::Soup soup;
        for (int i = 0; i < 11; ++i)
            for (int j = 0; j < 11; ++j) soup.vertex(Vec3d(i - 5, 0, j - 5));
        for (std::uint32_t i = 0; i < 10; ++i)
            for (std::uint32_t j = 0; j < 10; ++j) {
                const std::uint32_t v = 11 * i + j;
                soup.indices.insert(soup.indices.end(), {v, v + 1, v + 12, v, v + 12, v + 11});
            }
        return soup;
    }
    StepResult moveBox(const Vec3d& to) { return frame({{.transform = box.transform, .translation = to}}); }
};

TEST(Stop, WhatStandsOnTheFloorSlidesAndRisesButDoesNotSink) {
    BoxOnFloor scene;
    EXPECT_FALSE(scene.frame({}).contacts.empty());
    EXPECT_EQ(scene.moveBox(Vec3d(0.3, 0.49, 0.2)).stopped.size(), 1u);
    EXPECT_NEAR(scene.at(scene.box.transform).translation.y(), 0.5, 1e-9);
    EXPECT_EQ(scene.moveBox(Vec3d(0.3, -30, 0.2)).stopped.size(), 1u);
    EXPECT_NEAR(scene.at(scene.box.transform).translation.y(), 0.5, 1e-9);
    for (int i = 1; i <= 30; ++i)
        EXPECT_TRUE(scene.moveBox(Vec3d(0.3 + 0.1 * i, 0.5, 0.2 - 0.07 * i)).stopped.empty())
            << "over tiles and seams, " << i;
    EXPECT_TRUE(scene.moveBox(Vec3d(3.3, 2, 0)).stopped.empty());
    EXPECT_TRUE(scene.frame({}).contacts.empty());
}

TEST(Stop, ATurnedBoxOnASlopeDoesNotSinkEither) {
    // The same, all turned by something that rounds, so that nothing is exactly flat.
    BoxOnFloor scene;
    const Quatd turn = Quatd(0.8, 0.3, -0.2, 0.45).normalized();
    const auto at = [&](const Vec3d& p) {
        return TentativeTransform{.transform = scene.box.transform, .translation = turn * p, .rotation = turn};
    };
    scene.commit({.transform = scene.floor.transform, .rotation = turn});
    scene.commit(at(Vec3d(0.3, 0.5, 0.2)));
    for (int i = 0; i < 20; ++i) scene.frame({at(Vec3d(0.3, 0.4, 0.2))});
    EXPECT_NEAR((turn.conjugate() * scene.at(scene.box.transform).translation).y(), 0.5, 2e-4);
}

TEST(Stop, TwoLikeBoxesInLineDoNotSlideIntoEachOther) {
    // Their sides lie in the same planes, so inside each other no face would cross a face: only what looks at each
    // other tells.
    SceneMaker scene;
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, 0));
    scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(1, 0, 0));
    scene.interest(box.node);
    EXPECT_EQ(scene.frame({{.transform = box.transform, .translation = Vec3d(0.5, 0, 0)}}).stopped.size(), 1u);
    EXPECT_NEAR(scene.at(box.transform).translation.x(), 0, 1e-9);
    EXPECT_TRUE(scene.frame({{.transform = box.transform, .translation = Vec3d(0, 0.3, 0)}}).stopped.empty());
    EXPECT_TRUE(scene.frame({{.transform = box.transform, .translation = Vec3d(-0.3, 0.3, 0)}}).stopped.empty());
}

TEST(Stop, ImpossibleWishesAreRefusedAndNothingElseIs) {
    BoxAndWall scene;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto refused = [&](TentativeTransform wish) {
        const StepResult result = scene.frame({wish});
        EXPECT_EQ(scene.at(scene.box.transform).translation, Vec3d::Zero());
        EXPECT_EQ(scene.at(scene.box.transform).scale, Vec3d::Ones());
        return result.stopped == std::vector{wish.transform};
    };
    const ObjectId box = scene.box.transform;
    EXPECT_TRUE(refused({.transform = box, .translation = Vec3d(nan, 0, 0)}));
    EXPECT_TRUE(refused({.transform = box, .translation = Vec3d(0, HUGE_VAL, 0)}));
    EXPECT_TRUE(refused({.transform = box, .translation = Vec3d(0, 1e200, 0)}));
    EXPECT_TRUE(refused({.transform = box, .rotation = Quatd(0, 0, 0, 0)}));
    EXPECT_TRUE(refused({.transform = box, .rotation = Quatd(1, nan, 0, 0)}));
    EXPECT_TRUE(refused({.transform = box, .scale = Vec3d(1, 0, 1)}));
    EXPECT_TRUE(refused({.transform = box, .scale = Vec3d(1, -1, 1)})) << "through zero";
    EXPECT_TRUE(refused({.transform = box, .scale = Vec3d(1, 1e-200, 1)}));
    EXPECT_TRUE(refused({.transform = ObjectId(987654)}));
    EXPECT_TRUE(refused({.transform = scene.box.node})) << "a node is no Transform";
    EXPECT_TRUE(scene.frame({scene.to(1)}).stopped.empty());
}

TEST(Stop, OfSeveralWishesForOneTransformTheLowestSourceCounts) {
    BoxAndWall scene;
    TentativeTransform dragged = scene.to(1), animated = scene.to(2);
    dragged.source = 0;
    animated.source = 1;
    for (const auto& wishes : {std::vector{dragged, animated}, std::vector{animated, dragged}}) {
        const StepResult result = scene.pipeline.step(scene.aspect, wishes);
        ASSERT_EQ(result.accepted.size(), 1u);
        EXPECT_EQ(result.accepted[0].translation.x(), 1.0);
        EXPECT_EQ(result.accepted[0].source, 0);
    }
}

TEST(Stop, ARunOutOfWorkStopsWhereItIsKnownToBeFreeAndSaysSo) {
    CollisionLimits limits;
    limits.maxTests = 200;
    SceneMaker scene(limits);
    const auto ball = scene.body(kRootNode, shapes::sphere(0.5, 40, 80), Vec3d::Zero());
    scene.body(kRootNode, shapes::sphere(0.5, 40, 80), Vec3d(3, 0.4, 0));
    scene.interest(ball.node);
    const StepResult result = scene.frame({{.transform = ball.transform, .translation = Vec3d(6, 0, 0)}});
    EXPECT_EQ(result.stopped.size(), 1u);
    EXPECT_GT(result.counters.notLookedAt, 0u);
    EXPECT_LT(result.counters.boxTests + result.counters.triangleTests, 300u);
    EXPECT_LT(scene.at(ball.transform).translation.x(), 2.1);
    EXPECT_TRUE(scene.frame({{.transform = ball.transform, .translation = Vec3d(-6, 0, 0)}}).stopped.empty())
        << "away from everything costs nothing";
}

TEST(Stop, ALongWayPastManyThingsCostsLittle) {
    // 900 balls beside an aisle, a wall at its end; what is passed at a distance is not asked about, nor is what stands
    // behind the wall.
    SceneMaker scene;
    const ObjectId ball = scene.geometry(shapes::sphere(0.4, 8, 12));
    for (int i = 0; i < 300; ++i)
        for (const double z : {-1.0, 1.0, 40.0})
            scene.node(scene.node(kRootNode, scene.transform(Vec3d(i, 0, z))), ball);
    for (int i = 0; i < 50; ++i) scene.node(scene.node(kRootNode, scene.transform(Vec3d(250 + i, 0, 0))), ball);
    scene.body(kRootNode, shapes::box(Vec3d(0.2, 10, 1)), Vec3d(240, 0, 0));
    const auto box = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(-5, 0, 0));
    scene.interest(box.node);
    const StepResult result = scene.frame({{.transform = box.transform, .translation = Vec3d(400, 0, 0)}});
    EXPECT_NEAR(scene.at(box.transform).translation.x(), 239.4, 1e-3);
    EXPECT_EQ(result.counters.objects, 952u);
    EXPECT_LT(result.counters.pairsTested, 200u);
    EXPECT_LT(result.counters.boxTests + result.counters.triangleTests, 10'000u);
    EXPECT_EQ(scene.frame({}).counters.pairsTested, 0u);
}

TEST(Stop, ContactsAreSortedAndCutAtTheLimit) {
    CollisionLimits limits;
    limits.maxContacts = 10;
    SceneMaker scene(limits);
    const auto ball = scene.body(kRootNode, shapes::sphere(1, 20, 40), Vec3d::Zero());
    scene.body(kRootNode, shapes::sphere(1, 20, 40), Vec3d(1, 0.1, 0));
    scene.body(kRootNode, shapes::sphere(1, 20, 40), Vec3d(-1, 0.1, 0));
    scene.interest(ball.node, {}, Interest::kReport);
    const StepResult result = scene.frame({});
    EXPECT_EQ(result.contacts.size(), 10u);
    EXPECT_GT(result.counters.contactsLeftOut, 100u);
    EXPECT_EQ(result.contactsBegun, 2u);
    const auto key = [](const Contact& c) { return std::tuple(c.objectA, c.objectB, c.faceA, c.faceB); };
    for (std::size_t i = 1; i < result.contacts.size(); ++i)
        EXPECT_LT(key(result.contacts[i - 1]), key(result.contacts[i]));
}

}  // namespace
}  // namespace tessera
