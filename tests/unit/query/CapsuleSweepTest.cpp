// A capsule on a straight way among triangles: beside exact predicates and distances in long double that nobody here
// has worked out.
#include <gtest/gtest.h>

#include <random>

#include "server/collision/query/CapsuleSweep.h"

namespace tessera {
namespace {

using LongReal = long double;
using LongPoint = Eigen::Matrix<LongReal, 3, 1>;

LongPoint nearestOnEdge(const LongPoint& a, const LongPoint& b, const LongPoint& p) {
    const LongPoint ab = b - a;
    const LongReal square = ab.squaredNorm();
    const LongReal t = square > 0 ? std::clamp<LongReal>(ab.dot(p - a) / square, 0, 1) : 0;
    return a + t * ab;
}

LongPoint nearestOnFace(const std::array<LongPoint, 3>& t, const LongPoint& p) {
    const LongPoint n = (t[1] - t[0]).cross(t[2] - t[0]);
    if (n.squaredNorm() > 0) {
        const LongPoint foot = p - n.dot(p - t[0]) / n.squaredNorm() * n;
        bool inside = true;
        for (std::size_t i = 0; i < 3; ++i) inside = inside && n.dot((t[(i + 1) % 3] - t[i]).cross(foot - t[i])) >= 0;
        if (inside) return foot;
    }
    LongPoint best = nearestOnEdge(t[0], t[1], p);
    for (std::size_t i = 1; i < 3; ++i)
        if (const LongPoint q = nearestOnEdge(t[i], t[(i + 1) % 3], p); (q - p).norm() < (best - p).norm()) best = q;
    return best;
}

/// How far a point of the segment is from a convex set is a convex function of where it is on the segment: golden
/// sections close in on the least, as slowly for sets that nearly lie along each other as for others.
LongReal distanceBetween(const Vec3d& a, const Vec3d& b, const Triangle& triangle) {
    const std::array<LongPoint, 3> t = {triangle[0].cast<LongReal>(), triangle[1].cast<LongReal>(),
                                        triangle[2].cast<LongReal>()};
    const LongPoint from = a.cast<LongReal>(), along = b.cast<LongReal>() - from;
    const auto distance = [&](LongReal s) {
        const LongPoint p = from + s * along;
        return (p - nearestOnFace(t, p)).norm();
    };
    if (a == b) return distance(0);
    const LongReal section = (std::sqrt(LongReal(5)) - 1) / 2;
    LongReal low = 0, high = 1, left = 1 - section, right = section;
    LongReal atLeft = distance(left), atRight = distance(right);
    LongReal best = std::min({distance(0), distance(1), atLeft, atRight});
    for (int i = 0; i < 60; ++i) {
        if (atLeft <= atRight) {
            high = right, right = left, atRight = atLeft;
            atLeft = distance(left = high - section * (high - low));
        } else {
            low = left, left = right, atLeft = atRight;
            atRight = distance(right = low + section * (high - low));
        }
        best = std::min({best, atLeft, atRight});
    }
    return best;
}

struct CapsuleHunt {
    explicit CapsuleHunt(unsigned s) : seed(s), random(s) {}
    unsigned seed;
    std::mt19937 random;
    double number(double from, double to) { return std::uniform_real_distribution(from, to)(random); }
    bool chance(double p) { return number(0, 1) < p; }
    Vec3d point(double reach) { return {number(-reach, reach), number(-reach, reach), number(-reach, reach)}; }
    /// Large and small, needles, plates along the axes, points.
    Triangle triangle() {
        const Vec3d at = point(3);
        const double size = std::pow(10.0, number(-3, 1));
        Triangle t = {at, at + size * point(1), at + size * point(1)};
        if (chance(0.1)) t[2] = t[1];
        if (chance(0.1)) t[2] = t[0] + 0.5 * (t[1] - t[0]) + 1e-9 * point(1);
        if (chance(0.3))
            for (Vec3d& corner : t) corner.y() = at.y();
        return t;
    }
};

/// The axis with its way, as two triangles.
bool axisMeets(const Capsule& body, const Vec3d& way, const Triangle& t) {
    const Vec3d c = body.a + way, d = body.b + way;
    return trianglesIntersect({body.a, body.b, d}, t) || trianglesIntersect({body.a, d, c}, t);
}

TEST(CapsuleSweep, IsNeverLateAndStopsWhereItTouches) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    SCOPED_TRACE(
        testing::Message() << "TESSERA_SEED=" << seed
                           << " build/bin/unit_query --gtest_filter=CapsuleSweep.IsNeverLateAndStopsWhereItTouches");
    CapsuleHunt hunt(seed);
    int hits = 0, frees = 0;
    for (int round = 0; round < 2'000; ++round) {
        std::vector<Triangle> obstacles;
        for (int i = 0; i < 6; ++i) obstacles.push_back(hunt.triangle());
        Capsule body{.a = hunt.point(1), .radius = hunt.number(0.01, 0.5)};
        body.b = hunt.chance(0.2) ? body.a : Vec3d(body.a + Vec3d(0, hunt.number(0, 2), 0));
        Vec3d way = std::pow(10.0, hunt.number(-2, 2)) * hunt.point(1);
        if (hunt.chance(0.2)) way = hunt.number(0.5, 2) * (obstacles.front()[0] - body.a);
        std::erase_if(obstacles,
                      [&](const Triangle& t) { return distanceBetween(body.a, body.b, t) < body.radius * (1 + 1e-5); });
        const std::optional<CapsuleHit> hit = sweepCapsule(body, way, obstacles);
        const Vec3d done = (hit ? hit->t : 1) * way;
        (hit ? hits : frees)++;
        for (const Triangle& t : obstacles) {
            ASSERT_FALSE(axisMeets(body, done, t)) << "round " << round;
            for (int i = 1; i <= 16; ++i) {
                const Vec3d at = i / 16.0 * done;
                ASSERT_GE(distanceBetween(body.a + at, body.b + at, t), body.radius * (1 - 1e-9))
                    << "round " << round << ", at " << i;
            }
        }
        if (hit) {
            const Triangle& met = obstacles[hit->obstacle];
            ASSERT_LE(distanceBetween(body.a + done, body.b + done, met), body.radius * (1 + 1e-4))
                << "round " << round;
            ASSERT_LT(hit->normal.dot(way), 0) << "round " << round;
            ASSERT_NEAR(hit->normal.norm(), 1, 1e-12);
        }
    }
    EXPECT_GT(hits, 100);
    EXPECT_GT(frees, 100);
}

/// Whatever touches at the start: ways that lead away or along are free, those that lead into it are not.
TEST(CapsuleSweep, WhoTouchesMayGoAwayAndAlong) {
    const Triangle floor = {Vec3d(-10, 0, -10), Vec3d(10, 0, -10), Vec3d(0, 0, 20)};
    for (const double depth : {0.0, 1e-9, 0.01, 0.2}) {
        const Capsule body{.a = Vec3d(0, 0.25 - depth, 0), .b = Vec3d(0, 2, 0), .radius = 0.25};
        const std::vector obstacles = {floor};
        EXPECT_FALSE(sweepCapsule(body, Vec3d(3, 0, 1), obstacles)) << depth;
        EXPECT_FALSE(sweepCapsule(body, Vec3d(0, 1, 0), obstacles)) << depth;
        const std::optional<CapsuleHit> hit = sweepCapsule(body, Vec3d(1, -1, 0), obstacles);
        ASSERT_TRUE(hit) << depth;
        EXPECT_EQ(hit->t, 0) << depth;
        EXPECT_NEAR(hit->normal.y(), 1, 1e-12);
    }
    const Capsule pierced{.a = Vec3d(0, -1, 0), .b = Vec3d(0, 1, 0), .radius = 0.25};
    for (const Vec3d& way : {Vec3d(0, 5, 0), Vec3d(0, -5, 0), Vec3d(3, 0, 0)})
        EXPECT_FALSE(sweepCapsule(pierced, way, std::vector{floor})) << "who is stuck gets out";
}

TEST(CapsuleSweep, ABallMeetsAFaceWithoutAreaWhereverOnIt) {
    const Vec3d left(-9, 0, 0), right(9, 0, 0), middle(-3, 0, 0);
    for (const Triangle& thread :
         {Triangle{left, left, right}, Triangle{right, left, left}, Triangle{left, right, left},
          Triangle{left, middle, right}, Triangle{middle, left, right}})
        for (const double x : {-9.0, -5.0, 0.0, 7.0, 9.0}) {
            const Vec3d start(x, 2, 0);
            const std::optional<CapsuleHit> hit =
                sweepCapsule({start, start, 0.25}, Vec3d(0, -4, 0), std::vector{thread});
            ASSERT_TRUE(hit) << x;
            EXPECT_NEAR(hit->t, 1.75 / 4, 1e-6) << x;
            EXPECT_NEAR(hit->normal.y(), 1, 1e-9) << x;
        }
}

TEST(CapsuleSweep, TheFirstOfAll) {
    std::vector<Triangle> plates;
    for (const double z : {-5.0, -3.0, -4.0}) plates.push_back({Vec3d(-9, -9, z), Vec3d(9, -9, z), Vec3d(0, 9, z)});
    const std::optional<CapsuleHit> hit =
        sweepCapsule({Vec3d::Zero(), Vec3d::UnitY(), 0.5}, Vec3d(0, 0, -1000), plates);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->obstacle, 1u);
    EXPECT_NEAR(hit->t, 2.5 / 1000, 1e-8);
    EXPECT_LE(hit->t, 2.5 / 1000);
    EXPECT_FALSE(sweepCapsule({Vec3d::Zero(), Vec3d::UnitY(), 0.5}, Vec3d::Zero(), plates));
    EXPECT_FALSE(sweepCapsule({Vec3d::Zero(), Vec3d::UnitY(), 0.5}, Vec3d(0, 0, 1), plates));
}

}  // namespace
}  // namespace tessera
