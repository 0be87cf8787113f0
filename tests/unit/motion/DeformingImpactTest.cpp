#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <random>

#include "server/collision/query/TimeOfImpact.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

using bodies::Body;

std::vector<Vec3d> positionsOf(const Body& body) {
    const TriangleMesh mesh = body.mesh();
    return {mesh.positions().begin(), mesh.positions().end()};
}

std::vector<Vec3d> displaced(const Body& body, const std::function<Vec3d(const Vec3d&)>& to) {
    std::vector<Vec3d> out = positionsOf(body);
    for (Vec3d& p : out) p = to(p);
    return out;
}

std::vector<Triangle> facesAt(const Body& body, const std::vector<Vec3d>& end, double t) {
    const TriangleMesh mesh = body.mesh();
    std::vector<Triangle> out;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        Triangle triangle;
        for (unsigned i = 0; i < 3; ++i) triangle[i] = (1 - t) * mesh.corner(f, i) + t * end[mesh.vertexOf(f, i)];
        out.push_back(triangle);
    }
    return out;
}

Impact impactOf(const Body& a, const std::vector<Vec3d>& endA, const Body& b, const std::vector<Vec3d>& endB,
                double tolerance = 1e-4) {
    QueryWork work;
    return timeOfImpact(a.tree(), endA, b.tree(), endB, work, {.tolerance = tolerance});
}

TEST(DeformingImpact, ASheetThatBulgesReachesTheCeiling) {
    const Body floor = bodies::grid(20, 2.0), ceiling = bodies::grid(3, 4.0).moved(Vec3d(0.01, 0.02, 1));
    // The middle vertex rises to 3, the others less.
    const std::vector<Vec3d> bulged =
        displaced(floor, [](const Vec3d& p) { return Vec3d(p.x(), p.y(), 3 - p.x() * p.x() - p.y() * p.y()); });
    const Impact found = impactOf(floor, bulged, ceiling, positionsOf(ceiling));
    ASSERT_TRUE(found.hit && found.complete);
    EXPECT_LE(found.t, 1.0 / 3);
    EXPECT_NEAR(found.t, 1.0 / 3, 1e-4 / 3 + 1e-12);
    EXPECT_LE(found.distance, 1e-4);
    EXPECT_NEAR(found.normal.z(), 1, 1e-9);
    EXPECT_NEAR(found.point.head<2>().norm(), 0, 1e-6);
}

/// A motion that is a translation is one, whoever is asked.
TEST(DeformingImpact, AgreesWithRigidBodiesOnTranslations) {
    constexpr unsigned kSeed = 41;
    std::mt19937 random(kSeed);
    std::normal_distribution<double> n;
    const Body torus = bodies::torus(0.8, 0.3, 16, 10);
    int hits = 0;
    for (int i = 0; i < 50; ++i) {
        const Vec3d start = 2.5 * Vec3d(n(random), n(random), n(random)).normalized();
        const Vec3d way = -2 * start + 2 * Vec3d(n(random), n(random), n(random)).normalized();
        const Body other = bodies::sphere(0.5, 10, 12).moved(start);
        QueryWork work;
        const BodyMotion motion{.start = {}, .end = {.translation = way}};
        const Impact rigid = timeOfImpact(torus.tree(), {}, other.tree(), motion, work, {.tolerance = 1e-7});
        const Impact found = impactOf(torus, positionsOf(torus), other,
                                      displaced(other, [&](const Vec3d& p) -> Vec3d { return p + way; }), 1e-7);
        ASSERT_EQ(found.hit, rigid.hit) << "seed " << kSeed << ", trial " << i;
        if (!found.hit) continue;
        ++hits;
        ASSERT_NEAR(found.t, rigid.t, 1e-4) << "seed " << kSeed << ", trial " << i;
    }
    EXPECT_GT(hits, 10);
}

/// Against brute force: no dense sample before t touches, at t the distance is what is said, at most the tolerance.
TEST(DeformingImpact, IsNeverMissedAndNeverLate) {
    constexpr unsigned kSeed = 42;
    std::mt19937 random(kSeed);
    std::normal_distribution<double> n;
    std::uniform_real_distribution<double> u(-1, 1);
    int hits = 0, misses = 0;
    for (int i = 0; i < 150; ++i) {
        const auto again = [&] { return testing::Message() << "seed " << kSeed << ", trial " << i; };
        const std::array<Body, 4> shapes = {bodies::sphere(0.7, 6, 8), bodies::grid(5, 1.6), bodies::soup(random, 20),
                                            bodies::torus(0.8, 0.3, 8, 6)};
        const Body& a = shapes[random() % 4];
        const Vec3d away = (1.6 + 0.5 * u(random)) * Vec3d(n(random), n(random), n(random)).normalized();
        const Body b = shapes[random() % 4].moved(away);
        const auto deformed = [&](const Body& body, const Vec3d& by) {
            const Mat3d m = Mat3d::Identity() + 0.5 * Mat3d::NullaryExpr([&] { return u(random); });
            return displaced(body, [&](const Vec3d& p) -> Vec3d {
                return m * p + by + 0.1 * Vec3d(u(random), u(random), u(random));
            });
        };
        const std::vector<Vec3d> endA = deformed(a, Vec3d::Zero());
        const std::vector<Vec3d> endB =
            deformed(b, -away * (1 + 0.5 * u(random)) + 2 * Vec3d(n(random), n(random), n(random)).normalized());
        const double tolerance = i % 3 ? 1e-4 : 1e-8;
        const Impact found = impactOf(a, endA, b, endB, tolerance);
        ASSERT_TRUE(found.complete) << again();
        for (int s = 0; s <= 120; ++s) {
            const double t = s / 120.0;
            if (found.hit && t >= found.t) break;
            ASSERT_FALSE(bodies::touching(facesAt(a, endA, t), facesAt(b, endB, t))) << again() << ", t = " << t;
        }
        ++(found.hit ? hits : misses);
        const Impact swapped = impactOf(b, endB, a, endA, tolerance);
        ASSERT_EQ(swapped.hit, found.hit) << again();
        if (!found.hit) continue;
        const double distance = bodies::distance(facesAt(a, endA, found.t), facesAt(b, endB, found.t));
        ASSERT_LE(distance, tolerance) << again();
        ASSERT_NEAR(found.distance, distance, 1e-12) << again();
        ASSERT_NEAR(found.normal.norm(), 1, 1e-9) << again();
        ASSERT_LE(bodies::distance(facesAt(a, endA, swapped.t), facesAt(b, endB, swapped.t)), tolerance) << again();
    }
    EXPECT_GT(hits, 30);
    EXPECT_GT(misses, 30);
}

/// Long faces all about a ball, so that the boxes of nearly all pairs meet: what is nearest when the first two are
/// within the tolerance is found, and not by measuring every pair.
TEST(DeformingImpact, AmongLongFacesTheNearestPairIsFoundWithoutMeasuringAll) {
    constexpr unsigned kSeed = 44;
    std::mt19937 random(kSeed);
    std::normal_distribution<double> n;
    const Body ball = bodies::sphere(1, 8, 12);
    const std::size_t pairs = 168 * 96;
    for (int i = 0; i < 12; ++i) {
        // With the larger one several are within it at once.
        const double tolerance = i % 2 == 0 ? 1e-4 : 0.05;
        Body cage;
        for (int f = 0; f < 96; ++f) {
            const Vec3d normal = Vec3d(n(random), n(random), n(random)).normalized(), along = normal.unitOrthogonal();
            const Vec3d middle = (1.01 + 0.1 * std::abs(n(random))) * normal;
            const std::uint32_t a = cage.vertex(middle - 20 * along), b = cage.vertex(middle + 20 * along),
                                c = cage.vertex(middle + 0.3 * normal.cross(along));
            cage.face(a, b, c);
        }
        const std::vector<Vec3d> swollen = displaced(ball, [](const Vec3d& p) -> Vec3d { return 1.2 * p; });
        QueryWork work;
        const Impact found =
            timeOfImpact(ball.tree(), swollen, cage.tree(), positionsOf(cage), work, {.tolerance = tolerance});
        ASSERT_TRUE(found.hit && found.complete) << "seed " << kSeed << ", trial " << i;
        const std::vector<Triangle> a = facesAt(ball, swollen, found.t), b = facesAt(cage, positionsOf(cage), found.t);
        const double least = bodies::distance(a, b);
        ASSERT_LE(least, tolerance) << "seed " << kSeed << ", trial " << i;
        ASSERT_NEAR(found.distance, least, 1e-12) << "seed " << kSeed << ", trial " << i;
        ASSERT_NEAR(nearestPoints(a[found.faces.a], b[found.faces.b]).distance, least, 1e-12)
            << "seed " << kSeed << ", trial " << i;
        EXPECT_LT(work.triangleTests, pairs);
    }
}

TEST(DeformingImpact, TouchingAtTheStartIsAtZero) {
    const Body sheet = bodies::grid(8, 1.0);
    const auto along = [](const Vec3d& way) { return [way](const Vec3d& p) -> Vec3d { return p + way; }; };
    // On each other, corner on corner: lifted, slid, turned, or left as they are.
    for (const Vec3d& way : {Vec3d(0, 0, 1), Vec3d(0.3, 0.1, 0), Vec3d(0, 0, 0), Vec3d(5, 0, 0)}) {
        const Impact found = impactOf(sheet, positionsOf(sheet), sheet, displaced(sheet, along(way)));
        EXPECT_TRUE(found.hit && found.complete);
        EXPECT_EQ(found.t, 0);
        EXPECT_EQ(found.distance, 0);
        EXPECT_NEAR(found.normal.norm(), 1, 1e-9);
    }
    const Body ball = bodies::sphere(1, 8, 10), inside = bodies::box(Vec3d(1.5, 1.5, 1.5));
    const Impact deep = impactOf(ball, positionsOf(ball), inside, displaced(inside, along(Vec3d(9, 0, 0))));
    EXPECT_TRUE(deep.hit);
    EXPECT_EQ(deep.t, 0);
    EXPECT_EQ(deep.distance, 0);
}

/// Sheets with degenerate faces that slide over each other just outside the tolerance.
TEST(DeformingImpact, LongGrazingTakesBoundedWork) {
    Body low = bodies::grid(30, 1.0);
    for (std::uint32_t v = 0; v < 200; ++v) low.face(v, v, v + 1), low.face(v, v, v);
    const Body high = low.moved(Vec3d(0, 0, 2e-4));
    const std::vector<Vec3d> slid = displaced(high, [](const Vec3d& p) -> Vec3d { return p + Vec3d(0.7, 0.4, 0); });
    QueryWork work;
    EXPECT_FALSE(timeOfImpact(low.tree(), positionsOf(low), high.tree(), slid, work).hit);
    EXPECT_LT(work.boxTests + work.triangleTests, 10u);
    // Turned and buckled a little, still outside.
    const std::vector<Vec3d> turned = displaced(high, [](const Vec3d& p) {
        return Vec3d(0.9 * p.x() - 0.4 * p.y(), 0.4 * p.x() + 0.9 * p.y(), p.z() + 1e-4 * std::sin(20 * p.x()));
    });
    QueryWork more;
    const Impact found = timeOfImpact(low.tree(), positionsOf(low), high.tree(), turned, more);
    EXPECT_TRUE(found.complete);
    EXPECT_LT(more.boxTests + more.triangleTests, 1'000'000u);
}

TEST(DeformingImpact, AFinalTouchCountsAndAPassDoesNot) {
    const Body box = bodies::box(Vec3d(1, 1, 1)), other = box.moved(Vec3d(3, 0.2, 0.1));
    const auto by = [&](const Vec3d& way) {
        return displaced(other, [way](const Vec3d& p) -> Vec3d { return p + way; });
    };
    const Impact touch = impactOf(box, positionsOf(box), other, by(Vec3d(-2, 0, 0)));
    EXPECT_TRUE(touch.hit);
    EXPECT_NEAR(touch.t, 1, 1e-4);
    EXPECT_FALSE(impactOf(box, positionsOf(box), other, by(Vec3d(-1.99, 0, 0))).hit);
    const Body beside = box.moved(Vec3d(3, 1.001, 0));
    EXPECT_FALSE(impactOf(box, positionsOf(box), beside,
                          displaced(beside, [](const Vec3d& p) -> Vec3d { return p - Vec3d(6, 0, 0); }))
                     .hit);
}

TEST(DeformingImpact, MeetsBackwardsWhatItMeetsForwards) {
    constexpr unsigned kSeed = 43;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> u(-1, 1);
    const Body a = bodies::torus(0.8, 0.3, 10, 8);
    int hits = 0;
    for (int i = 0; i < 60; ++i) {
        const Body b = bodies::sphere(0.4, 6, 8).moved(Vec3d(2 * u(random), 2 * u(random), 2));
        const std::vector<Vec3d> end = displaced(b, [&](const Vec3d& p) -> Vec3d {
            return Vec3d(p.y(), p.x(), p.z() - 4) + 0.1 * Vec3d(u(random), u(random), u(random));
        });
        Body later = b;
        later.positions.clear();
        for (const Vec3d& p : end) later.vertex(p);
        const Body reversed = later.moved(Vec3d::Zero());  // with a tree of its own
        const Impact forwards = impactOf(a, positionsOf(a), b, end, 1e-9);
        const Impact backwards = impactOf(a, positionsOf(a), reversed, positionsOf(b), 1e-9);
        ASSERT_EQ(forwards.hit, backwards.hit) << "seed " << kSeed << ", trial " << i;
        hits += forwards.hit;
    }
    EXPECT_GT(hits, 10);
    EXPECT_LT(hits, 60);
}

TEST(DeformingImpact, GivesUpWhereToldTo) {
    const Body ball = bodies::sphere(1, 20, 24), other = ball.moved(Vec3d(4, 0.1, 0));
    const std::vector<Vec3d> end = displaced(other, [](const Vec3d& p) -> Vec3d { return p - Vec3d(8, 0, 0); });
    const Impact truth = impactOf(ball, positionsOf(ball), other, end);
    ASSERT_TRUE(truth.hit);
    for (const std::uint64_t limit : {0u, 1u, 10u, 40u}) {
        QueryWork work{.limit = limit};
        const Impact found = timeOfImpact(ball.tree(), positionsOf(ball), other.tree(), end, work);
        EXPECT_FALSE(found.complete);
        EXPECT_FALSE(found.hit);
        EXPECT_LE(found.t, truth.t);
    }
}

TEST(DeformingImpact, BadInputHasDefinedAnswers) {
    const Body box = bodies::box(Vec3d(1, 1, 1)), nothing;
    std::vector<Vec3d> end = positionsOf(box);
    const auto unknown = [](const Impact& i) { return !i.hit && !i.complete && i.t == 0; };
    EXPECT_FALSE(impactOf(nothing, {}, box, end).hit);
    EXPECT_TRUE(impactOf(nothing, {}, box, end).complete);
    EXPECT_TRUE(unknown(impactOf(box, {}, box, end)));
    end[3].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(unknown(impactOf(box, positionsOf(box), box, end)));
    end[3].y() = 1e60;
    EXPECT_TRUE(unknown(impactOf(box, end, box, positionsOf(box))));
    const Body other = box.moved(Vec3d(3, 0, 0));
    const std::vector<Vec3d> met = displaced(other, [](const Vec3d& p) -> Vec3d { return p - Vec3d(4, 0, 0); });
    for (const double tolerance : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        const Impact found = impactOf(box, positionsOf(box), other, met, tolerance);
        EXPECT_TRUE(found.hit && found.complete);
        EXPECT_LE(found.t, 0.5);
        EXPECT_NEAR(found.t, 0.5, 1e-12);
    }
}

}  // namespace
}  // namespace tessera
