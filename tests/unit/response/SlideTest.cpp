#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "server/collision/response/Tangent.h"
#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

constexpr double kSlideGap = 1e-4 * 1.7320508075688772;  // stopTolerance times the unit box's diagonal

TEST(Tangent, GoesAlongWhatItMeets) {
    const Vec3d floor = Vec3d::UnitY(), wall = -Vec3d::UnitX(), back = -Vec3d::UnitZ();
    const Vec3d down(1, -1, 0.5);
    const auto along = [&](const std::vector<Vec3d>& met) { return tangent(down, met); };
    EXPECT_EQ(along({}), down);
    EXPECT_NEAR((along({floor}) - Vec3d(1, 0, 0.5)).norm(), 0, 1e-15);
    EXPECT_NEAR((along({floor, wall}) - Vec3d(0, 0, 0.5)).norm(), 0, 1e-15);
    EXPECT_EQ(along({floor, wall, back}), Vec3d(0, 0, 0)) << "a corner";
    EXPECT_EQ(along({-floor}), down) << "parting";
    EXPECT_NEAR((along({floor, floor}) - Vec3d(1, 0, 0.5)).norm(), 0, 1e-15);
    EXPECT_EQ(tangent(-Vec3d::UnitY(), std::vector<Vec3d>{floor}), Vec3d(0, 0, 0)) << "straight into it";
}

/// The nearest vector of those that go into nothing: no other that was tried is nearer.
TEST(Tangent, IsTheNearestThatGoesIntoNothing) {
    Dice dice(41);
    for (int trial = 0; trial < 300; ++trial) {
        const Vec3d wanted = dice.vector(-1, 1);
        std::vector<Vec3d> met;
        for (int i = 0; i <= trial % 5; ++i) met.push_back(dice.direction());
        const Vec3d best = tangent(wanted, met);
        for (const Vec3d& out : met) ASSERT_GE(out.dot(best), -1e-8) << trial;
        for (int k = 0; k < 2000; ++k) {
            const Vec3d other = best + (k % 2 ? 0.1 : 1.0) * dice.vector(-1, 1);
            if (std::any_of(met.begin(), met.end(), [&](const Vec3d& out) { return out.dot(other) < 0; })) continue;
            ASSERT_GE((other - wanted).norm(), (best - wanted).norm() - 1e-7) << trial;
        }
    }
}

/// A floor of n × n squares, 20 wide, in the plane y = 0, seen from above.
bodies::Body floorOf(std::uint32_t n) {
    bodies::Body flat = bodies::grid(n, 20), out;
    for (std::size_t i = 0; i < flat.positions.size(); i += 3)
        out.vertex(Vec3d(flat.positions[i], 0, -flat.positions[i + 1]));
    out.indices = flat.indices;
    return out;
}

struct Sliding : TrialScene {
    Thing box = body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(0, 0.7, 0));
    Sliding() { slides = true; }
    using TrialScene::at;
    Vec3d at() const { return placeOf(box.transform); }
};

TEST(Slide, AlongAFlatFloorOfManyTrianglesNothingCatches) {
    for (const std::uint32_t n : {1u, 37u}) {
        // At all angles, in one large frame and in many small ones.
        for (const double steepness : {1.0, 0.1, 1e-3, 1e-5, 5.0})
            for (const int frames : {1, 7, 200}) {
                Sliding scene;
                scene.body(kRootNode, floorOf(n), Vec3d::Zero());
                scene.watch(scene.box.node);
                const Vec3d way(5, -5 * steepness - 0.2, 3.3);
                for (int i = 0; i < frames; ++i) {
                    const Vec3d wanted = scene.at() + way / frames;
                    scene.goTo(scene.box.transform, wanted);
                    ASSERT_NEAR(scene.at().x(), wanted.x(), 1e-9) << n << ' ' << steepness << ' ' << frames << ' ' << i;
                    ASSERT_NEAR(scene.at().z(), wanted.z(), 1e-9) << n << ' ' << steepness << ' ' << frames << ' ' << i;
                    ASSERT_GT(scene.at().y(), 0.5);
                }
                EXPECT_NEAR(scene.at().y(), 0.5, kSlideGap) << n << ' ' << steepness << ' ' << frames;
            }
    }
}

TEST(Slide, ATurnedBoxOverATurnedFloorDoesNotCatchEither) {
    // Nothing is a round number any more; a corner or an edge goes over the seams.
    for (unsigned seed = 0; seed < 10; ++seed) {
        Dice dice(seed);
        const Quatd turn = dice.rotation();
        Sliding scene;
        const auto floor = scene.body(kRootNode, floorOf(23), Vec3d(1, 2, 3), turn);
        scene.put(scene.box.transform, {Vec3d(1, 2, 3) + turn * Vec3d(-3, 1.2, -3), dice.rotation(), Vec3d::Ones()});
        scene.watch(scene.box.node);
        const auto own = [&] { return Vec3d(turn.conjugate() * (scene.at() - Vec3d(1, 2, 3))); };
        for (int i = 0; i < 60; ++i) {
            const Vec3d before = own(), step(0.1, -0.05, 0.08);
            scene.goTo(scene.box.transform, scene.at() + turn * step);
            ASSERT_NEAR(own().x() - before.x(), step.x(), 1e-7) << "seed " << seed << ", frame " << i;
            ASSERT_NEAR(own().z() - before.z(), step.z(), 1e-7) << "seed " << seed << ", frame " << i;
            ASSERT_FALSE(scene.touching(scene.box.shape, floor.shape));
        }
        EXPECT_LE(scene.distance(scene.box.shape, floor.shape), kSlideGap);
    }
}

TEST(Slide, IntoACornerAndUpTheCreaseAndThenItStands) {
    for (const int frames : {1, 40}) {
        Sliding scene;
        scene.body(kRootNode, floorOf(10), Vec3d::Zero());
        scene.body(kRootNode, bodies::box(Vec3d(0.2, 8, 20)), Vec3d(3.1, 0, 0));
        scene.body(kRootNode, bodies::box(Vec3d(20, 8, 0.2)), Vec3d(0, 0, 4.1));
        scene.watch(scene.box.node);
        // Floor, then wall, along both, until the other wall.
        for (int i = 0; i < frames; ++i) scene.goTo(scene.box.transform, scene.at() + Vec3d(6, -4, 5) / frames);
        EXPECT_NEAR(scene.at().x(), 2.5, 2 * kSlideGap) << frames;
        EXPECT_NEAR(scene.at().y(), 0.5, 2 * kSlideGap) << frames;
        EXPECT_NEAR(scene.at().z(), 3.5, 2 * kSlideGap) << frames;
        const Vec3d there = scene.at();
        for (int i = 0; i < 20; ++i) scene.goTo(scene.box.transform, scene.at() + Vec3d(1, -1, 1));
        EXPECT_LE((scene.at() - there).norm(), kSlideGap) << "pressed into the corner";
        // Out again in every direction.
        EXPECT_FALSE(scene.goTo(scene.box.transform, Vec3d(0, 3, 0)).stopped);
    }
}

TEST(Slide, DownASlopeAndOnAlongTheFloor) {
    for (const int frames : {3, 100}) {
        Sliding scene;
        const double angle = std::numbers::pi / 6;
        scene.body(kRootNode, floorOf(10), Vec3d::Zero());
        scene.body(kRootNode, bodies::box(Vec3d(6, 0.1, 6)), Vec3d(-2, 1.5, 0),
                   Quatd(Eigen::AngleAxisd(-angle, Vec3d::UnitZ())));
        scene.put(scene.box.transform, {Vec3d(-2, 3, 0), Quatd::Identity(), Vec3d::Ones()});
        scene.watch(scene.box.node);
        double lowest = 3;
        for (int i = 0; i < frames; ++i) {
            scene.goTo(scene.box.transform, scene.at() + Vec3d(0, -12.0, 0) / frames);
            EXPECT_LE(scene.at().y(), lowest + 1e-9);
            lowest = scene.at().y();
        }
        EXPECT_NEAR(lowest, 0.5, 2 * kSlideGap) << frames;
        EXPECT_GT(scene.at().x(), 0.5) << "carried forwards by the slope";
    }
}

TEST(Slide, StaysStillWherePushedStraightIntoAWall) {
    Sliding scene;
    scene.body(kRootNode, floorOf(10), Vec3d::Zero());
    scene.watch(scene.box.node);
    for (int i = 0; i < 50; ++i) scene.goTo(scene.box.transform, scene.at() - Vec3d(0, 1, 0));
    EXPECT_NEAR(scene.at().x(), 0, 1e-9);
    EXPECT_NEAR(scene.at().z(), 0, 1e-9);
    EXPECT_NEAR(scene.at().y(), 0.5, kSlideGap);
    EXPECT_GT(scene.at().y(), 0.5);
}

TEST(Slide, WhatStandsExactlyOnTheFloorSlidesWhenPressedDown) {
    Sliding scene;
    scene.body(kRootNode, floorOf(10), Vec3d::Zero());
    scene.put(scene.box.transform, {Vec3d(0, 0.5, 0), Quatd::Identity(), Vec3d::Ones()});
    scene.watch(scene.box.node);
    for (int i = 1; i <= 30; ++i) {
        scene.goTo(scene.box.transform, scene.at() + Vec3d(0.11, -0.1, 0.07));
        ASSERT_NEAR(scene.at().x(), 0.11 * i, 1e-9) << i;
        ASSERT_NEAR(scene.at().y(), 0.5, 1e-9) << i;
    }
}

TEST(Slide, OverABallOfManyFacets) {
    Sliding scene;
    const auto ball = scene.body(kRootNode, bodies::sphere(2, 40, 60), Vec3d(-1.2, -2, 0.2));
    scene.watch(scene.box.node);
    // Falls onto it, and down its side, never into it, always further down.
    double last = scene.at().y();
    for (int i = 0; i < 200; ++i) {
        scene.goTo(scene.box.transform, scene.at() - Vec3d(0, 0.05, 0));
        ASSERT_FALSE(scene.touching(scene.box.shape, ball.shape)) << i;
        ASSERT_LE(scene.at().y(), last + 1e-9) << i;
        last = scene.at().y();
    }
    EXPECT_LT(last, -3);
}

TEST(Slide, NeverTunnelsInOneHugeFrame) {
    // A thin sheet on the way along the floor.
    Sliding scene;
    scene.body(kRootNode, floorOf(10), Vec3d::Zero());
    const auto sheet = scene.body(kRootNode, bodies::sheet(6, 6), Vec3d(4, 0, 0),
                                  Quatd(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3d::UnitY())));
    scene.watch(scene.box.node);
    const Resolution result = scene.goTo(scene.box.transform, Vec3d(9, -3, 0.5));
    EXPECT_LT(scene.at().x(), 3.5);
    EXPECT_NEAR(scene.at().x(), 3.5, kSlideGap);
    EXPECT_NEAR(scene.at().z(), 0.5, 1e-6) << "and along the sheet, too";
    EXPECT_FALSE(scene.touching(scene.box.shape, sheet.shape));
    ASSERT_EQ(result.hits.size(), 2u) << "floor and sheet";
    EXPECT_LT(result.hits[0].fraction, result.hits[1].fraction);
    EXPECT_LE(result.hits[1].fraction, 1);
}

TEST(Slide, WhatOnlyStopsEndsIt) {
    TrialScene scene;
    scene.slides = true;
    const auto box = scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(0, 0.7, 0));
    const auto floor = scene.body(kRootNode, floorOf(4), Vec3d::Zero());
    const auto wall = scene.body(kRootNode, bodies::box(Vec3d(0.2, 8, 20)), Vec3d(3.1, 0, 0));
    scene.watch(box.node, floor.node);
    scene.slides = false;
    scene.watch(box.node, wall.node);
    scene.slides = true;
    scene.goTo(box.transform, Vec3d(1, -3, 1));
    EXPECT_NEAR(scene.placeOf(box.transform).x(), 1, 1e-9) << "the floor lets it";
    scene.goTo(box.transform, Vec3d(5, -3, 3));
    EXPECT_NEAR(scene.placeOf(box.transform).x(), 2.5, kSlideGap);
    // The leg along the floor ended where it met the wall: at 1.5 of 4 along x, so at 1 + 2 · 0.375 along z.
    EXPECT_NEAR(scene.placeOf(box.transform).z(), 1.75, 1e-3) << "the wall does not";
}

TEST(Slide, TheRotationStaysWhereItWasStopped) {
    Sliding scene;
    scene.body(kRootNode, floorOf(10), Vec3d::Zero());
    scene.watch(scene.box.node);
    Pose wanted{Vec3d(2, 0.65, 0), Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitZ())), Vec3d::Ones()};
    const Resolution result = scene.go(scene.box.transform, wanted);
    EXPECT_TRUE(result.stopped);
    const double angle = scene.at(scene.box.transform).rotation.angularDistance(Quatd::Identity());
    EXPECT_GT(angle, 0.05);
    EXPECT_LT(angle, 0.69);
    EXPECT_NEAR(scene.at().x(), 2, 1e-6) << "and the rest of the translation goes on";
}

TEST(Slide, BelowATurnedAndScaledParentTheWorldCounts) {
    Dice dice(3);
    for (int trial = 0; trial < 20; ++trial) {
        TrialScene scene;
        scene.slides = true;
        const Vec3d scale = trial % 2 ? Vec3d(dice.uniform(0.5, 2), dice.uniform(0.5, 2), -dice.uniform(0.5, 2))
                                      : Vec3d(Vec3d::Constant(1.7));
        const ObjectId parent = scene.node(kRootNode, scene.transform(dice.vector(-1, 1), dice.rotation(), scale));
        const Affine3d frame = worldTransform(scene.aspect, parent);
        const auto ball = scene.body(parent, bodies::sphere(0.4, 12, 16), frame.inverse() * Vec3d(0, 2, 0));
        const auto floor = scene.body(kRootNode, floorOf(10), Vec3d::Zero());
        scene.watch(ball.node);
        const Vec3d from = frame * scene.placeOf(ball.transform), wanted(2, -1.5, 1);
        scene.goTo(ball.transform, frame.inverse() * wanted);
        const Vec3d to = frame * scene.placeOf(ball.transform);
        EXPECT_NEAR(to.x(), wanted.x(), 1e-6) << trial;
        EXPECT_NEAR(to.z(), wanted.z(), 1e-6) << trial;
        EXPECT_GT(to.y(), 0);
        EXPECT_FALSE(scene.touching(ball.shape, floor.shape)) << trial;
        EXPECT_LT(to.y(), from.y());
    }
}

/// Soups and rings thrown through each other: whatever the legs do, nothing new touches, at the end or on the way.
TEST(Slide, NothingNewEverTouchesInRandomScenes) {
    int stopped = 0, further = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
        Dice dice(seed);
        TrialScene slide, stop;
        slide.slides = true;
        std::array<std::vector<ObjectScene::Thing>, 2> things;
        for (TrialScene* scene : {&slide, &stop}) {
            Dice same(seed);
            auto& mine = things[scene == &stop];
            const auto pick = [&] {
                return same.chance(0.3)   ? bodies::torus(0.6, 0.25, 10, 6)
                       : same.chance(0.5) ? bodies::sphere(0.6, 6, 9)
                                          : bodies::box(same.vector(0.3, 1.2));
            };
            mine.push_back(scene->body(kRootNode, pick(), Vec3d(-4, 0, 0), same.rotation()));
            for (int i = 0; i < 6; ++i)
                mine.push_back(scene->body(kRootNode, pick(), 1.2 * same.vector(-1, 1), same.rotation()));
            scene->watch(mine[0].node);
        }
        for (int frame = 0; frame < 8; ++frame) {
            const Vec3d before = slide.placeOf(things[0][0].transform);
            const Vec3d wanted = (frame % 3 == 0 ? 4.0 : 0.6) * dice.vector(-1, 1);
            Pose pose{wanted, dice.chance(0.5) ? dice.rotation() : slide.at(things[0][0].transform).rotation,
                      Vec3d::Ones()};
            stop.put(things[1][0].transform, slide.at(things[0][0].transform));
            const Resolution slid = slide.go(things[0][0].transform, pose);
            const Resolution halted = stop.go(things[1][0].transform, pose);
            for (std::size_t i = 1; i < things[0].size(); ++i)
                ASSERT_FALSE(slide.touching(things[0][0].shape, things[0][i].shape))
                    << "seed " << seed << ", frame " << frame;
            ASSERT_EQ(slid.stopped, halted.stopped) << "seed " << seed << ", frame " << frame;
            if (!slid.stopped) continue;
            ++stopped;
            const double left = (slide.placeOf(things[0][0].transform) - wanted).norm(),
                         leftWhenStopped = (stop.placeOf(things[1][0].transform) - wanted).norm();
            ASSERT_LE(left, leftWhenStopped + 1e-3 * (wanted - before).norm() + 1e-3)
                << "seed " << seed << ", frame " << frame;
            further += left < 0.9 * leftWhenStopped;
        }
    }
    EXPECT_GT(stopped, 60);
    EXPECT_GT(further, stopped / 4);
    std::printf("%d stopped, %d of them went on\n", stopped, further);
}

}  // namespace
}  // namespace tessera
