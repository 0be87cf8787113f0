/// Stacks, piles, sleep.
#include <map>

#include "server/collision/convex/ConvexQuery.h"
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

struct Tower {
    Shape floor = terrain(10, 10, [](double, double) { return 0.0; }), box = hullShape(boxPoints({1, 1, 1}));
    World w;
    explicit Tower(int boxes, double gap = 0.005) {
        w.add(floor, Vec3d(0, 0, 0), 0);
        for (int i = 0; i < boxes; ++i) w.add(box, Vec3d(0.01 * (i % 3), 0.5 + (1 + gap) * i, 0.01 * (i % 2)), 1);
    }
};

TEST(Pile, TenBoxesStandAndFallAsleep) {
    Tower t(10);
    t.w.run(240);
    EXPECT_EQ(t.w.last.asleep, 10U);
    for (std::uint32_t i = 1; i <= 10; ++i) {
        EXPECT_LT((t.w.at(i) - Vec3d(0.01 * ((i - 1) % 3), i - 0.5, 0.01 * ((i - 1) % 2))).norm(), 0.1) << i;
        EXPECT_EQ(t.w.bodies[i].velocity, Vec3d(0, 0, 0));
    }
}

TEST(Pile, SleepersKeepExactlyStill) {
    Tower t(3);
    t.w.run(240);
    ASSERT_EQ(t.w.last.asleep, 3U);
    const Affine3d before = t.w.pose(2);
    t.w.run(10);
    EXPECT_TRUE(t.w.pose(2).matrix() == before.matrix());
    EXPECT_TRUE(t.w.last.motions[2].asleep);
    EXPECT_TRUE(t.w.last.motions[2].world_T_before.matrix() == Mat4d::Identity());
    EXPECT_EQ(t.w.last.contactPoints, 0U);
}

/// Which rest in each other by about the slop: exact queries find them touching.
TEST(Pile, WhatRestsTouches) {
    Tower t(4);
    t.w.run(240);
    const double slop = t.w.options.slop * std::sqrt(3.0);
    for (std::uint32_t i = 1; i < 4; ++i) {
        ConvexWork work;
        const Affine3d a_T_b = t.w.pose(i).inverse() * t.w.pose(i + 1);
        const HullDepth depth = hullDepth(*t.box.hull, *t.box.hull, a_T_b, work);
        EXPECT_TRUE(depth.touching) << i;
        EXPECT_LT(depth.depth, 2 * slop) << i;
    }
}

TEST(Pile, ABodyThatLandsWakesTheStack) {
    Tower t(3);
    t.w.run(240);
    ASSERT_EQ(t.w.last.asleep, 3U);
    const std::uint32_t late = t.w.add(t.box, Vec3d(0.3, 5, 0), 1);
    bool woke = false;
    for (int i = 0; i < 60; ++i) {
        t.w.step();
        woke = woke || t.w.last.asleep == 0;
    }
    EXPECT_TRUE(woke);
    t.w.run(200);
    EXPECT_EQ(t.w.last.asleep, 4U);
    EXPECT_NEAR(t.w.at(late).y(), 3.5, 0.05);
}

TEST(Pile, TheStackFallsWhenItsFloorIsTakenAway) {
    Tower t(3);
    t.w.run(240);
    ASSERT_EQ(t.w.last.asleep, 3U);
    const std::uint64_t floorPart = t.w.parts[0].id;
    ASSERT_EQ(t.w.stage->supports(), std::vector<std::uint64_t>{floorPart});
    // The floor goes: bodies and parts are passed without it, and that is said.
    t.w.stage->gone(floorPart);
    World w = std::move(t.w);
    w.bodies.erase(w.bodies.begin());
    w.parts.erase(w.parts.begin());
    for (std::uint32_t i = 0; i < 3; ++i) {
        w.bodies[i].parts = {i};
        w.parts[i].body = i;
    }
    w.run(30);
    EXPECT_EQ(w.last.asleep, 0U);
    for (std::uint32_t i = 0; i < 3; ++i) EXPECT_LT(w.bodies[i].velocity.y(), -4) << i;
}

TEST(Pile, WakesWhenDisturbedWhenGravityChangesAndWhenTheFloorMoves) {
    for (int what = 0; what < 3; ++what) {
        Tower t(2);
        t.w.run(240);
        ASSERT_EQ(t.w.last.asleep, 2U);
        if (what == 0) t.w.bodies[1].disturbed = true;
        if (what == 1) t.w.gravity = Vec3d(0, -5, 0);
        if (what == 2) t.w.pose(0).translation().y() -= 0.5;
        t.w.step();
        EXPECT_EQ(t.w.last.asleep, 0U) << what;
        EXPECT_FALSE(t.w.stage->asleep(t.w.bodies[2].id)) << what;
        if (what == 2) {
            t.w.run(30);
            EXPECT_LT(t.w.at(1).y(), 0.1);
        }
    }
}

TEST(Pile, APusherWakesASleeper) {
    Tower t(1);
    t.w.run(120);
    ASSERT_EQ(t.w.last.asleep, 1U);
    const std::uint32_t pusher = t.w.add(t.box, Vec3d(-1.5, 0.6, 0), 0);
    t.w.bodies[pusher].velocity = Vec3d(1, 0, 0);
    t.w.run(60);
    EXPECT_NEAR(t.w.at(1).x() - t.w.at(pusher).x(), 1, 0.03);
}

std::vector<Shape> mixedShapes() {
    std::vector<Shape> out;
    out.push_back(hullShape(boxPoints({0.3, 0.2, 0.25})));
    out.push_back(hullShape(spherePoints(0.15, 24)));
    out.push_back(hullShape({{0, 0.2, 0}, {0.15, -0.1, 0.1}, {-0.15, -0.1, 0.1}, {0, -0.1, -0.15}}));
    std::vector<Vec3d> prism;
    for (int i = 0; i < 8; ++i)
        for (const double y : {-0.15, 0.15})
            prism.emplace_back(0.12 * std::cos(i * std::numbers::pi / 4), y, 0.12 * std::sin(i * std::numbers::pi / 4));
    out.push_back(hullShape(prism));
    return out;
}

TEST(Pile, TwoHundredHullsComeToRestInABowl) {
    const auto height = [](double x, double z) { return 0.15 * (x * x + z * z); };
    const Shape bowl = terrain(5, 60, height);
    const std::vector<Shape> shapes = mixedShapes();
    World w;
    w.add(bowl, Vec3d(0, 0, 0), 0);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 200; ++i)
        w.add(shapes[static_cast<std::size_t>(i) % shapes.size()],
              Vec3d(-0.9 + 0.45 * (i % 5) + 0.05 * u(random), 1.2 + 0.5 * (i / 25),
                    -0.9 + 0.45 * (i / 5 % 5) + 0.05 * u(random)),
              1, Quatd(u(random), u(random), u(random), u(random)).normalized());
    int frames = 0;
    while (frames < 900 && w.last.asleep < 200) {
        w.step();
        ++frames;
    }
    EXPECT_EQ(w.last.asleep, 200U) << "after " << frames << " frames";
    double deepest = 0, most = 0;
    for (std::uint32_t i = 1; i < w.bodies.size(); ++i) {
        const Vec3d p = w.at(i);
        EXPECT_GT(p.y(), height(p.x(), p.z())) << i;
        EXPECT_LT(std::hypot(p.x(), p.z()), 4) << i;
        for (std::uint32_t j = i + 1; j < w.bodies.size(); ++j) {
            if (!w.boxOf(i).overlaps(w.boxOf(j))) continue;
            ConvexWork work;
            const RigidPart &a = w.parts[i], &b = w.parts[j];
            const double slop = w.options.slop * std::min(w.boxOf(i).size().norm(), w.boxOf(j).size().norm());
            const HullDepth depth = hullDepth(*a.hull, *b.hull, a.world.inverse() * b.world, work);
            deepest = std::max(deepest, depth.depth / slop);
            most = std::max(most, depth.depth);
        }
    }
    EXPECT_LT(deepest, 2.0) << "slops; " << most << " units";
}

/// More than are solved again as often as it takes: what does not settle is cut.
TEST(Pile, ManyHullsThrownAtEachOtherGetNoDeeperThanTheyMay) {
    const std::vector<Shape> shapes = mixedShapes();
    const Shape plate = hullShape(boxPoints({8, 0.02, 8}));
    World w;
    w.gravity *= 10;
    w.add(plate, Vec3d(0, 0, 0), 0);
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 250; ++i) {
        const std::uint32_t body =
            w.add(shapes[static_cast<std::size_t>(i) % shapes.size()],
                  Vec3d(-1.2 + 0.5 * (i % 6) + 0.02 * u(random), 0.4 + 0.5 * (i / 36), -1.2 + 0.5 * (i / 6 % 6)), 1,
                  Quatd(u(random), u(random), u(random), u(random)).normalized());
        w.bodies[body].velocity = Vec3d(-10 * w.at(body).x(), -10 - 10 * w.at(body).y(), -10 * w.at(body).z());
    }
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> before;
    std::size_t pressed = 0;
    for (int frame = 0; frame < 25; ++frame) {
        std::vector<double> size;
        for (std::uint32_t i = 0; i < w.bodies.size(); ++i) size.push_back(w.boxOf(i).size().norm());
        w.step();
        std::map<std::pair<std::uint32_t, std::uint32_t>, double> now;
        for (std::uint32_t i = 0; i < w.bodies.size(); ++i) {
            ASSERT_TRUE(i == 0 || w.at(i).y() > 0 || w.at(i).cwiseAbs().maxCoeff() > 3.8) << i << " in frame " << frame;
            for (std::uint32_t j = i + 1; j < w.bodies.size(); ++j) {
                if (!w.boxOf(i).overlaps(w.boxOf(j))) continue;
                ConvexWork work;
                const RigidPart &a = w.parts[i], &b = w.parts[j];
                const double depth = hullDepth(*a.hull, *b.hull, a.world.inverse() * b.world, work).depth;
                if (!(depth > 0)) continue;
                now[{i, j}] = depth;
                const double allowed = 0.01 * std::min(size[i], size[j]);
                const auto old = before.find({i, j});
                const double limit = std::max(allowed, old == before.end() ? 0 : old->second + 0.01 * allowed);
                ASSERT_LE(depth, limit + 0.005 * allowed + 1e-9) << i << " and " << j << " in frame " << frame;
                pressed += depth > 0.5 * allowed;
            }
        }
        before = std::move(now);
    }
    EXPECT_GT(pressed, 100U);
}

/// A tall piece topples when its centre is beyond its foot, and does not before.
TEST(Pile, ATiltedPieceTopplesOrSettles) {
    for (const double degrees : {8.0, 20.0}) {
        World w;
        const Shape floor = terrain(5, 10, [](double, double) { return 0.0; });
        std::vector<Vec3d> points;
        for (int i = 0; i < 12; ++i) {
            const double a = i * std::numbers::pi / 6;
            points.emplace_back(0.25 * std::cos(a), 0, 0.25 * std::sin(a));
            points.emplace_back(0.2 * std::cos(a), 2, 0.2 * std::sin(a));
        }
        const Shape piece = hullShape(points);
        w.add(floor, Vec3d(0, 0, 0), 0);
        const double angle = degrees * std::numbers::pi / 180;
        // It stands on the rim of its foot; the centre is about 0.95 up, so about 14.7 degrees is the limit.
        const std::uint32_t body =
            w.add(piece, Vec3d(0, 0.25 * std::sin(angle), 0), 1, Quatd(Eigen::AngleAxisd(-angle, Vec3d::UnitZ())));
        for (RigidBody& b : w.bodies) b.friction = 0.8;
        w.run(240);
        const double upright = w.pose(body).linear().col(1).y();
        if (degrees < 14)
            EXPECT_GT(upright, 0.999);
        else
            EXPECT_LT(upright, 0.3);
    }
}

}  // namespace
}  // namespace tessera::rigidbodytest
