// Bodies that are carried by others on ways of their own: the bounds that the search rests on, and its answers.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/Compose.h"
#include "server/collision/query/BodyWay.h"
#include "server/collision/query/TimeOfImpact.h"
#include "tests/property/Seeds.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

double in(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3d vector(Random& random) {
    return {in(random, -1, 1), in(random, -1, 1), in(random, -1, 1)};
}
Quatd turn(Random& random, double most) {
    return Quatd(Eigen::AngleAxisd(in(random, -most, most), vector(random).normalized()));
}

BodyMotion link(Random& random, bool even) {
    BodyMotion m;
    const auto scale = [&] {
        return even ? Vec3d::Constant(in(random, 0.6, 1.5)).eval()
                    : Vec3d(in(random, 0.5, 1.5), in(random, -0.2, 1.5), in(random, 0.5, 1.5));
    };
    m.start = {vector(random), turn(random, 3), scale()};
    m.end = {m.start.translation + in(random, 0, 1) * vector(random), turn(random, 2) * m.start.rotation,
             oneIn(random, 2) ? m.start.scale : scale()};
    if (!oneIn(random, 3)) {
        m.body_T_mesh = composeTransform(vector(random), turn(random, 3), Vec3d::Constant(in(random, 0.6, 1.5)));
        if (!even && oneIn(random, 2)) m.body_T_mesh.linear()(0, 1) += in(random, -0.5, 0.5);
    }
    return m;
}
BodyMotion carried(Random& random, bool even) {
    BodyMotion m = link(random, even);
    for (std::size_t i = 1 + below(random, 3); i > 0; --i) m.carriers.push_back(link(random, even));
    return m;
}

TEST(CarriedWay, IsBoundedInSpeedAndBend) {
    double fastest = 0, sharpest = 0;
    forSeeds(400, [&](Random& random) {
        const bool even = oneIn(random, 2);
        const BodyMotion motion = carried(random, even);
        const BodyWay way(motion);
        ASSERT_TRUE(way.valid());
        ASSERT_EQ(way.similarity(), even);
        const double radius = in(random, 0.1, 3);
        const double reach = way.reachAround(Vec3d::Zero(), radius);
        const Vec3d n = vector(random).normalized();
        for (int s = 0; s < 20; ++s) {
            const double t = in(random, 0.01, 0.99), h = 1e-4;
            const Vec3d x = radius * vector(random).normalized();
            const BodyMoment now = way.at(t);
            const Vec3d here = now.place(x), next = way.at(t + h).place(x), last = way.at(t - h).place(x);
            ASSERT_LT((here - motion.placeAt(t) * x).norm(), 1e-12 * way.extent(reach));
            const Vec3d velocity = now.velocity(x), second = (next - 2 * here + last) / (h * h);
            const double rounding = 1e-6 * way.extent(reach);
            ASSERT_LT(((next - last) / (2 * h) - velocity).norm(), 1e-5 * (1 + way.acceleration(reach)));
            ASSERT_LE(n.dot(velocity), way.advance(n, reach));
            ASSERT_LE(second.norm(), way.acceleration(reach) + rounding);
            ASSERT_LE(std::abs(n.dot(second)), way.accelerationAlong(n, reach) + rounding);
            fastest = std::max(fastest, velocity.norm() / way.advance(n, reach));
            sharpest = std::max(sharpest, second.norm() / way.acceleration(reach));
            const auto norm = [](const Mat3d& m) { return m.jacobiSvd().singularValues().x(); };
            ASSERT_LE(norm(now.linear), way.stretchAt(t) * (1 + 1e-12));
            ASSERT_LE(way.stretchAt(t), way.stretch() * (1 + 1e-12));
            ASSERT_LE(norm(now.turning), way.turn() * (1 + 1e-12));
            ASSERT_LE(way.stretchAt(t),
                      way.stretchAt(0) + t * (way.stretchAt(1) - way.stretchAt(0)) + way.stretchAboveChord() + 1e-12);
            ASSERT_LE(std::abs(way.stretchAt(t + h) - way.stretchAt(t)), h * way.swelling() + 1e-12);
            ASSERT_LE(here.cwiseAbs().maxCoeff(), way.extent(way.reachOf(x)) * (1 + 1e-12));
            if (!even) continue;
            ASSERT_NEAR(norm(now.linear), std::abs(way.scaleAt(t)), 1e-9);
            const BodyWay::Turned d = way.turned(n, t), then = way.turned(n, t + h), before = way.turned(n, t - h);
            ASSERT_LT((d.direction - (now.linear * way.at(0).linear.inverse() * n).normalized()).norm(), 1e-12);
            ASSERT_LT(((then.direction - before.direction) / (2 * h) - d.rate).norm(), 1e-5);
            ASSERT_LE(d.rate.norm(), d.turn * (1 + 1e-12));
            ASSERT_LE((then.direction - 2 * d.direction + before.direction).norm() / (h * h), d.turn * d.turn + 1e-6);
        }
    });
    // Not so far above that nothing would be known.
    EXPECT_GT(fastest, 0.3);
    EXPECT_GT(sharpest, 0.3);
}

TEST(CarriedMotion, IsNeverMissedAndNeverLate) {
    int hits = 0, misses = 0;
    forSeeds(150, [&](Random& random) {
        const bodies::Body ball = bodies::sphere(0.5, 6, 8), box = bodies::box(Vec3d(0.8, 0.02, 0.8));
        const bool even = oneIn(random, 2);
        BodyMotion motion = carried(random, even), other;
        if (oneIn(random, 2)) other = carried(random, even);
        // Somewhere on its way the one is where the other is.
        const double meet = in(random, 0.1, 0.9);
        BodyMotion& first = other.carriers.empty() ? other : other.carriers.front();
        const Vec3d to =
            (motion.placeAt(meet).translation() - other.placeAt(meet).translation() + 0.7 * vector(random));
        first.start.translation += to;
        first.end.translation += to;
        QueryWork work;
        const double tolerance = 1e-6;
        const Impact found = timeOfImpact(ball.tree(), motion, box.tree(), other, work, {.tolerance = tolerance});
        ASSERT_TRUE(found.complete);
        for (int s = 0; s <= 100; ++s) {
            const double t = s / 100.0;
            if (found.hit && t >= found.t) break;
            ASSERT_FALSE(bodies::touching(ball, motion.placeAt(t), box, other.placeAt(t))) << t;
        }
        ++(found.hit ? hits : misses);
        if (found.hit) {
            ASSERT_LE(bodies::distance(ball, motion.placeAt(found.t), box, other.placeAt(found.t)), tolerance);
        }
    });
    EXPECT_GT(hits, 50);
    EXPECT_GT(misses, 20);
}

/// What carries and stands still is a frame.
TEST(CarriedMotion, ByWhatStandsStillIsAsWithout) {
    forSeeds(60, [&](Random& random) {
        const bodies::Body ball = bodies::sphere(0.5, 6, 8), box = bodies::box(Vec3d(0.8, 0.02, 0.8));
        const BodyMotion free{.start = {Vec3d(2, 0, 0) + 0.3 * vector(random), turn(random, 3)},
                              .end = {Vec3d(-2, 0, 0) + 0.3 * vector(random), turn(random, 1)}};
        BodyMotion still{.start = {vector(random), turn(random, 3)}};
        still.end = still.start;
        BodyMotion held = free, standing = still;
        held.carriers = {still};
        QueryWork work;
        const Impact bare = timeOfImpact(ball.tree(), free, box.tree(), {}, work, {.tolerance = 1e-7});
        const Impact below = timeOfImpact(ball.tree(), held, box.tree(), standing, work, {.tolerance = 1e-7});
        ASSERT_EQ(bare.hit, below.hit);
        ASSERT_NEAR(bare.t, below.t, 1e-4);
    });
}

TEST(CarriedMotion, ByNonsenseIsUnknown) {
    const bodies::Body box = bodies::box(Vec3d::Ones());
    BodyMotion motion;
    motion.carriers.push_back({.end = {.translation = Vec3d(std::nan(""), 0, 0)}});
    QueryWork work;
    const Impact found = timeOfImpact(box.tree(), {}, box.tree(), motion, work);
    EXPECT_FALSE(found.hit);
    EXPECT_FALSE(found.complete);
    EXPECT_EQ(found.t, 0);
}

}  // namespace
}  // namespace tessera
