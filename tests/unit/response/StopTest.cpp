#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

/// A unit box at the origin and a wall of 10 × 10 whose near face stands at x = 5.
struct BoxAndWall : TrialScene {
    Thing box = body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d::Zero());
    Thing wall = body(kRootNode, bodies::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    BoxAndWall() { watch(box.node); }

    Resolution to(double x) { return goTo(box.transform, Vec3d(x, 0, 0)); }
    double x() const { return placeOf(box.transform).x(); }
};

constexpr double kGap = 1e-4 * 1.7320508075688772;  // stopTolerance times the box's diagonal

TEST(Stop, ABoxComesToRestAtTheWall) {
    BoxAndWall scene;
    for (int frame = 0; frame < 100; ++frame) {
        const double before = scene.x();
        const Resolution result = scene.to(before + 0.1);
        EXPECT_LT(scene.x() + 0.5, 5.0);
        EXPECT_GE(scene.x(), before - 1e-12);
        EXPECT_EQ(result.stopped, !result.hits.empty());
    }
    EXPECT_NEAR(scene.x() + 0.5, 5.0, kGap);
}

TEST(Stop, OneHugeStepDoesNotJumpTheWall) {
    for (const double far : {1000.0, 1e5}) {
        BoxAndWall scene;
        EXPECT_TRUE(scene.to(far).stopped);
        EXPECT_LT(scene.x() + 0.5, 5.0);
        EXPECT_NEAR(scene.x() + 0.5, 5.0, kGap);
        EXPECT_FALSE(scene.touching(scene.box.shape, scene.wall.shape));
    }
}

TEST(Stop, ASmallSheetThatWouldEndUpInsideTheBoxStopsIt) {
    // No sampling of poses finds this one: before and after, no triangles meet.
    TrialScene scene;
    const auto box = scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(kRootNode, bodies::sheet(0.2, 0.2), Vec3d(2, 0, 0),
               Quatd(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitY())));
    scene.watch(box.node);
    for (const double end : {2.0, 2.3, 500.0}) {
        scene.put(box.transform, {});
        const Resolution result = scene.goTo(box.transform, Vec3d(end, 0, 0));
        EXPECT_TRUE(result.stopped);
        EXPECT_LT(scene.placeOf(box.transform).x(), 1.5);
        EXPECT_NEAR(scene.placeOf(box.transform).x(), 1.5, kGap);
        EXPECT_FALSE(result.hits.empty());
    }
}

TEST(Stop, ReportsWhatStoppedIt) {
    BoxAndWall scene;
    scene.to(4);
    const Resolution result = scene.to(6);
    ASSERT_EQ(result.hits.size(), 1u);
    const Hit& hit = result.hits.front();
    const Obstacle& obstacle = scene.obstacles[hit.obstacle];
    EXPECT_EQ(scene.handler.parts()[obstacle.partA].node, scene.box.shape);
    EXPECT_EQ(scene.handler.parts()[obstacle.partB].node, scene.wall.shape);
    EXPECT_NEAR(hit.fraction, 0.25, 1e-3);
    const TriangleMesh a = scene.meshOf(scene.box.shape), b = scene.meshOf(scene.wall.shape);
    for (const FacePair& f : hit.faces) {
        const TriangleContact c =
            contactOf(transformed(hit.worldA, a.triangle(f.a)), transformed(hit.worldB, b.triangle(f.b)));
        EXPECT_NEAR(c.point.x(), 5.0, kGap);
        EXPECT_LE(std::abs(c.point.y()), 0.5 + kGap);
        EXPECT_NEAR((c.normal - Vec3d::UnitX()).norm(), 0, 1e-9) << c.normal.transpose();
    }
    EXPECT_FALSE(scene.to(3).stopped);
    EXPECT_EQ(scene.x(), 3.0);
}

TEST(Stop, ATurningBeamStopsAtThePostWithoutPassingIt) {
    // A beam of length 4 turns about z in one step of nearly half a turn; a thin post stands in the quarter.
    TrialScene scene;
    const auto beam = scene.body(kRootNode, bodies::box(Vec3d(4, 0.1, 0.1)), Vec3d::Zero());
    const auto post = scene.body(kRootNode, bodies::box(Vec3d(0.02, 0.02, 3)), Vec3d(0, 1.5, 0));
    scene.watch(beam.node);
    Pose wanted;
    wanted.rotation = Quatd(Eigen::AngleAxisd(3.0, Vec3d::UnitZ()));
    EXPECT_TRUE(scene.go(beam.transform, wanted).stopped);
    const double reached = scene.at(beam.transform).rotation.angularDistance(Quatd::Identity());
    // The beam's upper side meets the post's lower right corner (0.01, 1.49): at angle a its distance from the beam's
    // axis, 0.01·sin(a) - 1.49·cos(a) turned around, is half the thickness.
    const double expected = std::atan2(1.49, 0.01) - std::asin(0.05 / std::hypot(0.01, 1.49));
    EXPECT_LT(reached, expected + 1e-9);
    EXPECT_NEAR(reached, expected, 1e-3);
    const double gap = scene.distance(beam.shape, post.shape);
    EXPECT_GT(gap, 0);
    EXPECT_LE(gap, 1e-4 * 4.01);
}

TEST(Stop, AGrowingBoxStopsAtTheWall) {
    BoxAndWall scene;
    scene.to(4);
    EXPECT_TRUE(scene.go(scene.box.transform, {Vec3d(4, 0, 0), Quatd::Identity(), Vec3d(5, 1, 1)}).stopped);
    EXPECT_NEAR(scene.at(scene.box.transform).scale.x(), 2.0, 2 * kGap);
    EXPECT_LT(scene.at(scene.box.transform).scale.x(), 2.0);
}

TEST(Stop, TheWallIsStoppedByTheBoxTheInterestIsIn) {
    BoxAndWall scene;
    const Resolution result = scene.goTo(scene.wall.transform, Vec3d(-3, 0, 0));
    EXPECT_TRUE(result.stopped);
    // In sizes of what moves: the wall's.
    EXPECT_NEAR(scene.placeOf(scene.wall.transform).x(), 0.6, 1e-4 * 14.2);
    EXPECT_GT(scene.placeOf(scene.wall.transform).x(), 0.6);
    ASSERT_EQ(scene.obstacles.size(), 1u);
    EXPECT_EQ(scene.handler.parts()[scene.obstacles[0].partA].node, scene.box.shape)
        << "A is the interest's object, whoever moves";
}

TEST(Stop, ThroughItsOwnKindNothingIsStoppedWithoutAnInterest) {
    BoxAndWall scene;
    const auto ghost = scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(0, 0, 3));
    // The ghost is in nobody's way but the box's: the box is against everything.
    EXPECT_FALSE(scene.goTo(ghost.transform, Vec3d(20, 0, 3)).stopped) << "through the wall";
    EXPECT_FALSE(scene.goTo(ghost.transform, Vec3d(0, 0, 3)).stopped);
    EXPECT_TRUE(scene.goTo(ghost.transform, Vec3d(0, 0, -3)).stopped);
}

TEST(Stop, AConvoyUnderOneTransformDoesNotHinderItself) {
    // A trolley carries two boxes that touch; they ride along, and stop together at the wall.
    TrialScene scene;
    const ObjectId trolley = scene.transform();
    const ObjectId trolleyNode = scene.node(kRootNode, trolley);
    const auto carried = scene.body(trolleyNode, bodies::box(Vec3d::Ones()), Vec3d::Zero());
    scene.body(trolleyNode, bodies::box(Vec3d::Ones()), Vec3d(-1, 0, 0));
    scene.body(kRootNode, bodies::box(Vec3d(0.2, 10, 10)), Vec3d(5.1, 0, 0));
    scene.watch(carried.node);
    const Quatd turned(0.9, 0.1, 0, 0);
    EXPECT_FALSE(scene.go(trolley, {Vec3d(2, 0, 0), turned, Vec3d::Ones()}).stopped);
    EXPECT_TRUE(scene.go(trolley, {Vec3d(8, 0, 0), turned, Vec3d::Ones()}).stopped);
    EXPECT_NEAR(scene.placeOf(trolley).x(), 4.5, 2 * kGap);
    // Pulled apart by its own transform, the carried one is stopped by its companion again.
    EXPECT_TRUE(scene.goTo(carried.transform, Vec3d(-0.5, 0, 0)).stopped);
}

TEST(Stop, OneTransformAtTwoPlacesOfAChainStopsToo) {
    // An arm of two joints that bend by one angle. Its hand carries a box to the wall on a way that is no single
    // motion.
    TrialScene scene;
    const ObjectId joint = scene.transform();
    const ObjectId upper = scene.node(kRootNode, joint);
    const ObjectId elbow = scene.node(upper, scene.transform(Vec3d(2, 0, 0)));
    const ObjectId lower = scene.node(elbow, joint);
    const auto hand = scene.body(lower, bodies::box(Vec3d(0.5, 0.5, 0.5)), Vec3d(2, 0, 0));
    const auto wall = scene.body(kRootNode, bodies::box(Vec3d(10, 0.1, 10)), Vec3d(0, 2, 0));
    scene.watch(hand.node);
    Pose wanted;
    wanted.rotation = Quatd(Eigen::AngleAxisd(1.5, Vec3d::UnitZ()));
    const Resolution result = scene.go(joint, wanted);
    EXPECT_TRUE(result.stopped);
    EXPECT_EQ(result.undecided, 0u);
    EXPECT_FALSE(scene.touching(hand.shape, wall.shape));
    EXPECT_LE(scene.distance(hand.shape, wall.shape), 1e-4 * 0.87);
    // Elbow at 2 sin a, hand 2 sin 2a above it; its upper corner half a diagonal further.
    const double a = scene.at(joint).rotation.angularDistance(Quatd::Identity());
    EXPECT_NEAR(2 * std::sin(a) + 2 * std::sin(2 * a) + 0.25 * (std::sin(2 * a) + std::cos(2 * a)), 1.95, 1e-4);
}

TEST(Stop, TwoPlacesOfOneTransformStopAtEachOther) {
    // A door of two wings: one angle, mirrored frames, which close upon each other.
    TrialScene scene;
    const ObjectId hinge = scene.transform();
    const auto wing = [&](const Vec3d& at, const Vec3d& scale) {
        const ObjectId frame = scene.node(kRootNode, scene.transform(at, Quatd::Identity(), scale));
        const ObjectId node = scene.node(frame, hinge);
        return scene.body(node, bodies::box(Vec3d(1, 2, 0.1)), Vec3d(0.5, 0, 0));
    };
    Pose open;
    open.rotation = Quatd(Eigen::AngleAxisd(-1.2, Vec3d::UnitY()));
    scene.put(hinge, open);
    const auto left = wing(Vec3d(-0.99, 0, 0), Vec3d(1, 1, 1)), right = wing(Vec3d(0.99, 0, 0), Vec3d(-1, 1, 1));
    scene.watch(left.node);
    ASSERT_FALSE(scene.touching(left.shape, right.shape));
    const Resolution result = scene.go(hinge, {});
    EXPECT_TRUE(result.stopped);
    EXPECT_EQ(result.undecided, 0u);
    EXPECT_FALSE(scene.touching(left.shape, right.shape));
    EXPECT_LE(scene.distance(left.shape, right.shape), 1e-4 * 2.3);
}

TEST(Stop, WhatIsStuckCanBePulledOutButNotPushedDeeper) {
    BoxAndWall scene;
    scene.put(scene.box.transform, {Vec3d(4.58, 0, 0), Quatd::Identity(), Vec3d::Ones()});  // 0.08 deep
    EXPECT_FALSE(scene.to(4.5801).stopped) << "no more faces meet than before";
    EXPECT_TRUE(scene.to(5.1).stopped) << "its back faces would come to meet the wall, too";
    EXPECT_LT(scene.x() + 0.5, 5.2);
    EXPECT_FALSE(scene.to(3).stopped);
    EXPECT_EQ(scene.x(), 3.0);
}

/// A unit box that stands exactly on a floor of many triangles, as a scene's author would put it.
struct BoxOnFloor : TrialScene {
    Thing box = body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(0.3, 0.5, 0.2));
    Thing floor = body(kRootNode, tiles(), Vec3d::Zero());
    BoxOnFloor() { watch(box.node); }

    static bodies::Body tiles() {
        bodies::Body out;
        for (int i = 0; i < 11; ++i)
            for (int j = 0; j < 11; ++j) out.vertex(Vec3d(i - 5, 0, j - 5));
        for (std::uint32_t i = 0; i < 10; ++i)
            for (std::uint32_t j = 0; j < 10; ++j) {
                const std::uint32_t v = 11 * i + j;
                out.face(v, v + 1, v + 12);
                out.face(v, v + 12, v + 11);
            }
        return out;
    }
};

TEST(Stop, WhatStandsOnTheFloorSlidesAndRisesButDoesNotSink) {
    BoxOnFloor scene;
    EXPECT_TRUE(scene.goTo(scene.box.transform, Vec3d(0.3, 0.49, 0.2)).stopped);
    EXPECT_NEAR(scene.placeOf(scene.box.transform).y(), 0.5, 1e-9);
    EXPECT_TRUE(scene.goTo(scene.box.transform, Vec3d(0.3, -30, 0.2)).stopped);
    EXPECT_NEAR(scene.placeOf(scene.box.transform).y(), 0.5, 1e-9);
    for (int i = 1; i <= 30; ++i)
        EXPECT_FALSE(scene.goTo(scene.box.transform, Vec3d(0.3 + 0.1 * i, 0.5, 0.2 - 0.07 * i)).stopped)
            << "over tiles and seams, " << i;
    EXPECT_FALSE(scene.goTo(scene.box.transform, Vec3d(3.3, 2, 0)).stopped);
    EXPECT_FALSE(scene.touching(scene.box.shape, scene.floor.shape));
}

TEST(Stop, ATurnedBoxOnASlopeDoesNotSinkEither) {
    // The same, all turned by something that rounds, so that nothing is exactly flat.
    BoxOnFloor scene;
    const Quatd turn = Quatd(0.8, 0.3, -0.2, 0.45).normalized();
    const auto at = [&](const Vec3d& p) { return Pose{turn * p, turn, Vec3d::Ones()}; };
    scene.put(scene.floor.transform, {Vec3d::Zero(), turn, Vec3d::Ones()});
    scene.put(scene.box.transform, at(Vec3d(0.3, 0.5, 0.2)));
    for (int i = 0; i < 20; ++i) scene.go(scene.box.transform, at(Vec3d(0.3, 0.4, 0.2)));
    EXPECT_NEAR((turn.conjugate() * scene.placeOf(scene.box.transform)).y(), 0.5, 2e-4);
}

TEST(Stop, TwoLikeBoxesInLineDoNotSlideIntoEachOther) {
    // Their sides lie in the same planes, so inside each other no face would cross a face: only what looks at each
    // other tells.
    TrialScene scene;
    const auto box = scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(0, 0, 0));
    scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(1, 0, 0));
    scene.watch(box.node);
    EXPECT_TRUE(scene.goTo(box.transform, Vec3d(0.5, 0, 0)).stopped);
    EXPECT_NEAR(scene.placeOf(box.transform).x(), 0, 1e-9);
    EXPECT_FALSE(scene.goTo(box.transform, Vec3d(0, 0.3, 0)).stopped);
    EXPECT_FALSE(scene.goTo(box.transform, Vec3d(-0.3, 0.3, 0)).stopped);
}

/// Two balls as hulls, one of which is wholly within the other.
struct Hulls : TrialScene {
    Thing small = body(kRootNode, bodies::sphere(0.5, 10, 14), Vec3d::Zero());
    Thing large = body(kRootNode, bodies::sphere(2, 10, 14), Vec3d(0.3, 0, 0));
    explicit Hulls(bool both) {
        asHull(large.node);
        if (both) asHull(small.node);
        watch(small.node);
    }
    void asHull(ObjectId node) {
        CollisionObject value;
        value.node = node;
        value.shape = CollisionObject::kHull;
        object(value);
    }
};

TEST(Stop, AHullWithinAHullTouchesItAndGetsOutTheWayItIsNearest) {
    Hulls scene(true);
    EXPECT_TRUE(scene.goTo(scene.small.transform, Vec3d(0.3, 0, 0)).stopped) << "to where it is deepest";
    EXPECT_EQ(scene.obstacles.at(0).touchingAtStart, 1u);
    scene.put(scene.small.transform, {});
    EXPECT_FALSE(scene.goTo(scene.small.transform, Vec3d(-5, 0, 0)).stopped);
    EXPECT_TRUE(scene.goTo(scene.small.transform, Vec3d(0, 0, 0)).stopped) << "and not in again";
    EXPECT_NEAR(scene.placeOf(scene.small.transform).x(), -2.2, 0.1);
}

TEST(Stop, WhatASolidHullHasSwallowedGetsOutAndNotInAgain) {
    Hulls scene(false);
    EXPECT_FALSE(scene.goTo(scene.small.transform, Vec3d(-5, 0, 0)).stopped);
    EXPECT_TRUE(scene.goTo(scene.small.transform, Vec3d(5, 0, 0)).stopped);
    EXPECT_NEAR(scene.placeOf(scene.small.transform).x(), -2.2, 0.1);
}

TEST(Stop, ARunOutOfWorkStopsWhereItIsKnownToBeFreeAndSaysSo) {
    TrialScene scene;
    const auto ball = scene.body(kRootNode, bodies::sphere(0.5, 40, 80), Vec3d::Zero());
    const auto other = scene.body(kRootNode, bodies::sphere(0.5, 40, 80), Vec3d(3, 0.4, 0));
    scene.watch(ball.node);
    for (const std::uint64_t most : {0u, 10u, 60u}) {
        scene.put(ball.transform, {});
        scene.maxTests = most;
        const Resolution result = scene.goTo(ball.transform, Vec3d(6, 0, 0));
        EXPECT_TRUE(result.stopped);
        EXPECT_GT(result.undecided, 0u);
        EXPECT_LT(scene.work.boxTests + scene.work.triangleTests, most + 100);
        EXPECT_LT(scene.placeOf(ball.transform).x(), 2.1);
        EXPECT_FALSE(scene.touching(ball.shape, other.shape));
        EXPECT_FALSE(scene.goTo(ball.transform, Vec3d(-6, 0, 0)).stopped) << "away from everything costs nothing";
    }
}

TEST(Stop, ALongWayPastManyThingsCostsLittle) {
    // 300 balls beside an aisle, a wall at its end; what is passed at a distance is not asked about, nor is what stands
    // behind the wall.
    TrialScene scene;
    const ObjectId ball = scene.geometry(soupOf(bodies::sphere(0.4, 8, 12)));
    for (int i = 0; i < 150; ++i)
        for (const double z : {-1.0, 1.0}) scene.node(scene.node(kRootNode, scene.transform(Vec3d(i, 0, z))), ball);
    for (int i = 0; i < 50; ++i) scene.node(scene.node(kRootNode, scene.transform(Vec3d(150 + i, 0, 0))), ball);
    scene.body(kRootNode, bodies::box(Vec3d(0.2, 10, 1)), Vec3d(140, 0, 0));
    const auto box = scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(-5, 0, 0));
    scene.watch(box.node);
    EXPECT_TRUE(scene.goTo(box.transform, Vec3d(400, 0, 0)).stopped);
    EXPECT_NEAR(scene.placeOf(box.transform).x(), 139.4, kGap);
    EXPECT_LT(scene.queries, 10u);
    // (Most of them are of some fifty steps, which count as a hundred each.)
    EXPECT_LT(scene.work.boxTests + scene.work.triangleTests, 8'000u);
}

}  // namespace
}  // namespace tessera
