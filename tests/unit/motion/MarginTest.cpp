// First contacts of bodies that are thicker than their triangles (ImpactOptions::margin).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "server/collision/query/TimeOfImpact.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

using bodies::Body;

BodyMotion straight(const Vec3d& start, const Vec3d& end) {
    return {.start = {.translation = start}, .end = {.translation = end}};
}

Body pointAt(const Vec3d& at) {
    Body out;
    const std::uint32_t v = out.vertex(at);
    out.face(v, v, v);
    return out;
}

Impact impactOfThick(const Body& a, const BodyMotion& ma, const Body& b, const BodyMotion& mb, double margin,
                     double growth = 0) {
    QueryWork work;
    return timeOfImpact(a.tree(), ma, b.tree(), mb, work,
                        {.tolerance = 1e-9, .margin = margin, .marginGrowth = growth});
}

TEST(Margin, ABallMeetsPlateEdgeCornerAndBallWhenItShould) {
    const Body ball = pointAt(Vec3d::Zero()), plate = bodies::sheet(2, 2);
    struct Case {
        const char* name;
        Body other;
        Vec3d from, to;
        double t;
    };
    const double half = std::sqrt(0.5), third = std::sqrt(1.0 / 3);
    const Case cases[] = {
        {"plate", plate, {0.1, 0.2, 3}, {0.1, 0.2, -1}, 0.5},                                   // 3 - 4 t = 1
        {"edge", plate, {1, 0.2, 0}, {0, 0, 0}, 0},                                             // within it
        {"edge, slanting", plate, {1 + 3 * half, 0.1, 3 * half}, {1 - half, 0.1, -half}, 0.5},  // 3 - 4 t = 1
        {"corner", plate, Vec3d(1, 1, 0) + 3 * third * Vec3d::Ones(), Vec3d(1, 1, 0) - third * Vec3d::Ones(), 0.5},
        {"ball", ball, {3, 0.6, 0}, {-1, 0.6, 0}, 0.55},  // 3 - 4 t = 0.8
    };
    for (const Case& c : cases)
        for (const bool swapped : {false, true}) {
            const Impact found = swapped ? impactOfThick(ball, straight(c.from, c.to), c.other, {}, 1)
                                         : impactOfThick(c.other, {}, ball, straight(c.from, c.to), 1);
            ASSERT_TRUE(found.hit) << c.name;
            EXPECT_LE(found.t, c.t + 1e-15) << c.name;
            EXPECT_NEAR(found.t, c.t, 1e-9) << c.name;
            EXPECT_LE(found.distance, 1e-9) << c.name;
            EXPECT_NEAR(found.normal.norm(), 1, 1e-12) << c.name;
        }
    EXPECT_FALSE(impactOfThick(plate, {}, ball, straight({0.1, 0.2, 3}, {0.1, 0.2, 1.001}), 1).hit);
    EXPECT_FALSE(impactOfThick(ball, {}, ball, straight({3, 1.0001, 0}, {-3, 1.0001, 0}), 1).hit) << "passes by";
}

TEST(Margin, MayGrowAndShrinkOnTheWay) {
    const Body ball = pointAt(Vec3d::Zero()), plate = bodies::sheet(4, 4);
    // 3 - t = 0.5 + 4 t.
    const Impact grows = impactOfThick(plate, {}, ball, straight({0, 0.1, 3}, {0, 0.1, 2}), 0.5, 4);
    ASSERT_TRUE(grows.hit);
    EXPECT_LE(grows.t, 0.5);
    EXPECT_NEAR(grows.t, 0.5, 1e-9);
    // 2 - 1.5 t = 1 - t, beyond the end; one that shrinks as it comes is met later: 2 - 1.9 t = 1 - 0.9 t.
    EXPECT_FALSE(impactOfThick(plate, {}, ball, straight({0, 0.1, 2}, {0, 0.1, 0.5}), 1, -1).hit);
    const Impact shrinks = impactOfThick(plate, {}, ball, straight({0, 0.1, 2}, {0, 0.1, 0.1}), 1, -0.9);
    ASSERT_TRUE(shrinks.hit);
    EXPECT_NEAR(shrinks.t, 1, 1e-8);
    // Standing still.
    EXPECT_NEAR(impactOfThick(plate, {}, ball, straight({0, 0, 2}, {0, 0, 2}), 0, 4).t, 0.5, 1e-9);
    // Nobody moves before it is large enough.
    EXPECT_FALSE(impactOfThick(plate, {}, ball, straight({0, 0, 2}, {0, 0, 2}), 0, 1.999).hit);
}

TEST(Margin, TouchingAtTheStartIsAtZeroAndPartingIsNone) {
    const Body ball = pointAt(Vec3d::Zero()), plate = bodies::sheet(2, 2);
    EXPECT_EQ(impactOfThick(plate, {}, ball, straight({0, 0, 0.9}, {0, 0, 5}), 1).t, 0);
    EXPECT_TRUE(impactOfThick(plate, {}, ball, straight({0, 0, 0.9}, {0, 0, 5}), 1).hit);
    EXPECT_FALSE(impactOfThick(plate, {}, ball, straight({0, 0, 1 + 5e-10}, {0, 0, 5}), 1).hit);
}

TEST(Margin, BadOnesAreUnknown) {
    const Body ball = pointAt(Vec3d::Zero());
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    for (const auto& [margin, growth] :
         std::array<std::pair<double, double>, 5>{{{-1, 0}, {nan, 0}, {infinity, 0}, {1, -1.5}, {0, infinity}}}) {
        const Impact found = impactOfThick(ball, {}, ball, straight({3, 0, 0}, {-3, 0, 0}), margin, growth);
        EXPECT_TRUE(!found.hit && !found.complete && found.t == 0) << margin << ", " << growth;
    }
}

/// Beside distances by brute force: no dense sample before t is nearer than the margin, and at t it is that near.
TEST(Margin, IsNeverMissedAndNeverLate) {
    constexpr unsigned kSeed = 61;
    std::mt19937 random(kSeed);
    std::normal_distribution<double> n;
    std::uniform_real_distribution<double> u(-1, 1);
    const auto direction = [&] { return Vec3d(n(random), n(random), n(random)).normalized(); };
    int hits = 0;
    constexpr int kTrials = 80;
    for (int i = 0; i < kTrials; ++i) {
        const auto again = [&] { return testing::Message() << "seed " << kSeed << ", trial " << i; };
        const Body a = bodies::soup(random, 8), b = i % 3 ? bodies::soup(random, 6) : pointAt(Vec3d(0.2, 0.1, 0));
        BodyMotion ma, mb;
        const Vec3d d = direction();
        mb.start.translation = 4 * d;
        mb.end.translation = -3 * d + 2 * direction();
        mb.start.rotation = Quatd(n(random), n(random), n(random), n(random)).normalized();
        mb.end.rotation =
            i % 2 ? mb.start.rotation : Quatd(Eigen::AngleAxisd(2 * u(random), direction())) * mb.start.rotation;
        if (i % 4 == 1) ma.end.translation = direction();
        if (i % 5 == 2) mb.end.scale = Vec3d(1 + 0.5 * u(random), 1, 1 + 0.5 * u(random));
        const double margin = i % 7 ? 0.4 * (1 + u(random)) : 0, growth = i % 3 == 0 ? -margin * u(random) : 0;
        for (const VolumeKind volume : {VolumeKind::kObb, VolumeKind::kDop18, VolumeKind::kSphere}) {
            const TriangleTree treeA(a.mesh(), {.volume = volume}), treeB(b.mesh(), {.volume = volume});
            QueryWork work;
            const Impact found =
                timeOfImpact(treeA, ma, treeB, mb, work, {.tolerance = 1e-6, .margin = margin, .marginGrowth = growth});
            ASSERT_TRUE(found.complete) << again();
            const auto apart = [&](double t) {
                return bodies::distance(a, ma.placeAt(t), b, mb.placeAt(t)) - (margin + t * growth);
            };
            for (int s = 0; s <= 60; ++s) {
                const double t = s / 60.0;
                if (found.hit && t >= found.t) break;
                ASSERT_GT(apart(t), -1e-12) << again() << ", t = " << t;
            }
            if (!found.hit) continue;
            ++hits;
            ASSERT_LE(apart(found.t), 1e-6 + 1e-12) << again();
            ASSERT_NEAR(found.distance, std::max(0.0, apart(found.t)), 1e-12) << again();
        }
    }
    EXPECT_GT(hits, kTrials / 2);
    EXPECT_LT(hits, 3 * kTrials);
}

/// A ball that lies on a floor rolls along it and stops at the wall of the same mesh; where it is pressed it is
/// stopped.
TEST(Margin, SupportsHoldWhatIsThick) {
    Body hall;
    for (const double z : {-10.0, 10.0})
        for (const double x : {-10.0, 10.0}) hall.vertex(Vec3d(x, 0, z));
    for (const double z : {-10.0, 10.0})
        for (const double y : {0.0, 5.0}) hall.vertex(Vec3d(3, y, z));
    hall.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    const Body ball = pointAt(Vec3d::Zero());
    const std::vector<Support> supports{{.normal = Vec3d::UnitY(), .overlap = 1e-4, .rounding = 1e-10}};
    const auto go = [&](double sunk, const Vec3d& by) {
        QueryWork work;
        const Vec3d start(0, 0.5 - sunk, 0);
        return timeOfImpact(hall.tree(), {}, ball.tree(), straight(start, start + by), work,
                            {.tolerance = 1e-9, .supports = supports, .margin = 0.5});
    };
    for (const double sunk : {0.0, 5e-5}) {
        const Impact wall = go(sunk, {5, 0, 1});
        ASSERT_TRUE(wall.hit);
        EXPECT_NEAR(wall.t, 0.5, 1e-8);
        EXPECT_LE(wall.t, 0.5);
        EXPECT_EQ(wall.support, -1);
        EXPECT_FALSE(go(sunk, {-50, 0, 3}).hit);
        EXPECT_FALSE(go(sunk, {0, 20, 1}).hit);
        const Impact pressed = go(sunk, {1, -1, 0});
        ASSERT_TRUE(pressed.hit);
        EXPECT_NEAR(pressed.t, 0, 1e-6);
        EXPECT_EQ(pressed.support, 0);
    }
    const Impact deep = go(0.1, {-50, 0, 3});
    EXPECT_TRUE(deep.hit && deep.t == 0) << "deeper than the support allows";
}

}  // namespace
}  // namespace tessera
