#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "server/collision/convex/ConvexQuery.h"
#include "tests/unit/convex/ConvexShapes.h"
#include "tests/unit/convex/IntegerOracle.h"

namespace tessera {
namespace {

using convextest::IntPoints;
using convextest::Points;
using convextest::Random;
using oracle::Point;
using oracle::Wide;

ConvexHull hullOf(const IntPoints& points) {
    return convextest::hullOf(convextest::toDouble(points));
}

Touch touching(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b = Affine3d::Identity()) {
    ConvexWork work;
    return hullsTouching(a, b, a_T_b, work);
}

Touch truthOf(bool meet) {
    return meet ? Touch::kYes : Touch::kNo;
}

/// The same answer the other way round, from the distance and from the depth.
void expectTouching(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, bool truth) {
    ConvexWork work;
    ASSERT_EQ(hullsTouching(a, b, a_T_b, work), truthOf(truth));
    const HullDistance distance = hullDistance(a, b, a_T_b, work);
    ASSERT_TRUE(distance.complete);
    ASSERT_EQ(distance.distance == 0, truth) << distance.distance;
    const HullDepth depth = hullDepth(a, b, a_T_b, work);
    ASSERT_TRUE(depth.complete);
    ASSERT_EQ(depth.touching, truth);
    ASSERT_EQ(depth.depth < 0, !truth) << depth.depth;
    ASSERT_NEAR(depth.normal.norm(), 1, 1e-12);
}

TEST(HullsTouching, BoxesInACornerAnEdgeAndASide) {
    const ConvexHull unit = convextest::hullOf(convextest::box(Vec3d(1, 1, 1)));
    const auto at = [](double x, double y, double z) { return Affine3d(Eigen::Translation3d(x, y, z)); };
    for (const Vec3d& d : {Vec3d(1, 1, 1), Vec3d(1, 1, 0.5), Vec3d(1, 0.25, 0.5), Vec3d(1, 0, 0), Vec3d(0, 0, 0)}) {
        expectTouching(unit, unit, at(d.x(), d.y(), d.z()), true);
        if (d.x() == 0) continue;
        expectTouching(unit, unit, at(1 + 0x1p-52, d.y(), d.z()), false);
        expectTouching(unit, unit, at(1 - 0x1p-53, d.y(), d.z()), true);
    }
}

TEST(HullsTouching, AgreesWithAllTriplesOfSmallIntegers) {
    int met = 0, flat = 0, exact = 0;
    constexpr int kTrials = 6000;
    for (int seed = 0; seed < kTrials; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const int grid = 1 + seed % 5;
        std::uniform_int_distribution<int> k(0, grid), count(1, 7), shift(-grid / 2, grid / 2);
        const auto points = [&] {
            IntPoints out;
            for (int i = count(random); i > 0; --i) {
                const int x = k(random), y = k(random), z = k(random);
                out.push_back({x, y, z});
            }
            return out;
        };
        const IntPoints a = points();
        IntPoints b = points();
        const int dx = shift(random), dy = shift(random), dz = shift(random);
        const ConvexHull hullA = hullOf(a), hullB = hullOf(b);
        for (Point& p : b) p = {p.x + dx, p.y + dy, p.z + dz};
        const bool truth = convextest::hullsMeet(a, b);
        const Affine3d a_T_b(Eigen::Translation3d(dx, dy, dz));
        expectTouching(hullA, hullB, a_T_b, truth);
        expectTouching(hullB, hullA, a_T_b.inverse(), truth);
        if (HasFatalFailure()) return;
        met += truth;
        flat += hullA.dimension() < 3 || hullB.dimension() < 3;
        ConvexWork work;
        (void)hullsTouching(hullA, hullB, a_T_b, work);
        exact += work.exact > 0;
    }
    EXPECT_GT(met, kTrials / 5);
    EXPECT_LT(met, kTrials * 4 / 5);
    EXPECT_GT(flat, kTrials / 5);
    EXPECT_GT(exact, kTrials / 20) << "cases that rounding could not decide";
}

/// Axes times powers of two, as different as coordinates may be: that moves no body through another one.
TEST(HullsTouching, AgreesWithIntegersHoweverFarApartTheAxesAreScaled) {
    int met = 0, exact = 0;
    constexpr int kTrials = 6000;
    for (int seed = 0; seed < kTrials; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const int grid = 1 + seed % 4, most = seed % 2 ? 160 : 60;
        std::uniform_int_distribution<int> k(0, grid), count(2, 6), shift(-grid / 2, grid / 2), power(-most, most);
        const auto points = [&] {
            IntPoints out;
            for (int i = count(random); i > 0; --i) {
                const int x = k(random), y = k(random), z = k(random);
                out.push_back({x, y, z});
            }
            return out;
        };
        const IntPoints a = points();
        IntPoints b = points();
        const int px = power(random), py = power(random), pz = power(random);
        const auto hull = [&](const IntPoints& of) {
            Points out;
            for (const Vec3d& p : convextest::toDouble(of))
                out.emplace_back(std::ldexp(p.x(), px), std::ldexp(p.y(), py), std::ldexp(p.z(), pz));
            return convextest::hullOf(out);
        };
        const ConvexHull hullA = hull(a), hullB = hull(b);
        const int dx = shift(random), dy = shift(random), dz = shift(random);
        for (Point& p : b) p = {p.x + dx, p.y + dy, p.z + dz};
        const bool truth = convextest::hullsMeet(a, b);
        const Affine3d a_T_b(Eigen::Translation3d(std::ldexp(dx, px), std::ldexp(dy, py), std::ldexp(dz, pz)));
        ConvexWork work;
        ASSERT_EQ(hullsTouching(hullA, hullB, a_T_b, work), truthOf(truth));
        const HullDistance distance = hullDistance(hullA, hullB, a_T_b, work);
        ASSERT_TRUE(distance.complete);
        ASSERT_EQ(distance.distance == 0, truth) << distance.distance;
        ASSERT_EQ(hullDepth(hullA, hullB, a_T_b, work).touching, truth);
        met += truth;
        exact += work.exact > 0;
    }
    EXPECT_GT(met, kTrials / 5);
    EXPECT_GT(exact, kTrials / 5) << "cases that rounding could not decide";
}

/// Nothing is known of the answers but that there are some, the same for both orders.
TEST(HullsTouching, AnswersForAnyFiniteNumbers) {
    constexpr int kTrials = 3000;
    for (int seed = 0; seed < kTrials; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const int most = std::array{20, 60, 160, 300}[static_cast<std::size_t>(seed % 4)];
        std::uniform_int_distribution<int> count(1, 8), power(-most, most), kind(0, 5);
        std::uniform_real_distribution<double> share(-1, 1);
        const auto number = [&](double largest) {
            const int which = kind(random);
            const double value = which == 0 ? 0.0 : std::ldexp(share(random), power(random));
            return which == 1 ? std::copysign(1.0, value) : std::clamp(value, -largest, largest);
        };
        const auto hull = [&] {
            Points out;
            for (int i = count(random); i > 0; --i) {
                const double x = number(1e40), y = number(1e40), z = number(1e40);
                out.emplace_back(x, y, z);
            }
            return convextest::hullOf(out);
        };
        const ConvexHull a = hull(), b = hull();
        Affine3d a_T_b = Affine3d::Identity();
        if (seed % 3)
            for (int i = 0; i < 12; ++i) a_T_b.matrix()(i % 3, i / 3) = number(1e40);
        ConvexWork work;
        const HullDepth depth = hullDepth(a, b, a_T_b, work);
        const Touch touch = hullsTouching(a, b, a_T_b, work);
        EXPECT_NE(touch, Touch::kUnknown);
        EXPECT_EQ(depth.touching, touch == Touch::kYes);
        EXPECT_EQ(hullDistance(a, b, a_T_b, work).distance == 0, touch == Touch::kYes);
    }
}

/// Bodies on the two sides of a plane that share exactly a corner, an edge or a side of it, or miss it by one unit of
/// about four million; the plane is skew, so that no coordinate tells.
TEST(HullsTouching, DecidesByOneUnitInMillions) {
    int met = 0;
    constexpr int kTrials = 2000;
    for (int seed = 0; seed < kTrials; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        std::uniform_int_distribution<int> wide(-1000, 1000), deep(1, 1000), entry(-900, 900);
        const int contact = 1 + seed % 3;
        IntPoints a, b;
        for (int i = 0; i < 5; ++i) a.push_back({-deep(random), wide(random), wide(random)});
        for (int i = 0; i < 5; ++i) b.push_back({deep(random), wide(random), wide(random)});
        for (int i = 0; i < contact; ++i) a.push_back({0, wide(random), wide(random)});
        // Meets a's contact set for certain, or is put anywhere on the plane.
        b.push_back(seed % 2 ? a.back() : Point{0, wide(random), wide(random)});
        for (int i = 1; i < contact; ++i) b.push_back({0, wide(random), wide(random)});
        Wide m[3][3];
        for (auto& row : m)
            for (Wide& e : row) e = entry(random);
        const Point offset{wide(random), wide(random), wide(random)};
        const auto turned = [&](IntPoints points, Wide apart) {
            for (Point& p : points) {
                const Point q{p.x + apart, p.y, p.z};
                p = {m[0][0] * q.x + m[0][1] * q.y + m[0][2] * q.z + offset.x,
                     m[1][0] * q.x + m[1][1] * q.y + m[1][2] * q.z + offset.y,
                     m[2][0] * q.x + m[2][1] * q.y + m[2][2] * q.z + offset.z};
            }
            return points;
        };
        const IntPoints x = turned(a, 0), y = turned(b, 0);
        const bool truth = convextest::hullsMeet(x, y);
        ASSERT_TRUE(truth || seed % 2 == 0);
        expectTouching(hullOf(x), hullOf(y), Affine3d::Identity(), truth);
        met += truth;
        // One unit nearer or farther in one coordinate of one corner.
        IntPoints z = y;
        z[5].x += seed % 4 < 2 ? 1 : -1;
        expectTouching(hullOf(x), hullOf(z), Affine3d::Identity(), convextest::hullsMeet(x, z));
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(met, kTrials / 2);
}

TEST(HullsTouching, OneInsideTheOther) {
    Random random(8);
    for (int i = 0; i < 300; ++i) {
        const ConvexHull outer =
            convextest::hullOf(i % 2 ? convextest::sphere(2, 400) : convextest::box(Vec3d(4, 4, 4)));
        const ConvexHull inner = convextest::hullOf(convextest::anyBody(i, random));
        Affine3d m = Affine3d(Eigen::Translation3d(convextest::unitVector(random))) * convextest::rotation(random);
        m.scale(1e-3 * (1 + i % 100));
        EXPECT_EQ(touching(outer, inner, m), Touch::kYes);
        EXPECT_EQ(touching(inner, outer, m.inverse()), Touch::kYes);
    }
}

TEST(HullsTouching, UnderMapsThatMirrorFlattenAndCollapse) {
    const ConvexHull box = convextest::hullOf(convextest::box(Vec3d(2, 2, 2)));
    Affine3d m = Affine3d::Identity();
    m.linear() = Vec3d(-1, 2, 1).asDiagonal();
    m.translation() = Vec3d(2, 0, 0);
    expectTouching(box, box, m, true);
    m.translation() = Vec3d(2 + 0x1p-50, 0, 0);
    expectTouching(box, box, m, false);
    m.linear() = Vec3d(0, 1, 1).asDiagonal();  // a sheet
    m.translation() = Vec3d(1, 0, 0);
    expectTouching(box, box, m, true);
    m.translation() = Vec3d(1 + 0x1p-52, 0, 0);
    expectTouching(box, box, m, false);
    m.linear().setZero();  // a point
    m.translation() = Vec3d(1, 1, 1);
    expectTouching(box, box, m, true);
    m.translation() = Vec3d(1, 1, 1 + 0x1p-52);
    expectTouching(box, box, m, false);
}

TEST(HullsTouching, SaysSoWhereItDoesNotKnow) {
    const ConvexHull a = convextest::hullOf(convextest::sphere(1, 500));
    ConvexWork work{.limit = 2};
    const Affine3d m(Eigen::Translation3d(1.5, 0.9, 0.7));
    EXPECT_EQ(hullsTouching(a, a, m, work), Touch::kUnknown);
    EXPECT_LE(work.supports, 2u);
    const HullDistance distance = hullDistance(a, a, m, work);
    EXPECT_FALSE(distance.complete);
    EXPECT_LE(distance.distance, 0.1);
    const HullDepth depth = hullDepth(a, a, m, work);
    EXPECT_FALSE(depth.complete);
    EXPECT_TRUE(depth.touching) << "who must be safe takes it for a yes";
    Affine3d broken = Affine3d::Identity();
    broken.translation().x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(touching(a, a, broken), Touch::kUnknown);
}

TEST(HullsTouching, TellsTheSameWithAnyCache) {
    for (int seed = 0; seed < 2000; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        std::uniform_int_distribution<int> k(-2, 2);
        std::uniform_int_distribution<std::uint32_t> index(0, 11);
        const auto points = [&] {
            IntPoints out;
            for (int i = 0; i < 8; ++i) {
                const int x = k(random), y = k(random), z = k(random);
                out.push_back({x, y, z});
            }
            return out;
        };
        const ConvexHull a = hullOf(points()), b = hullOf(points());
        const double x = k(random), y = k(random), z = k(random);
        const Affine3d m(Eigen::Translation3d(2 * x, y, z));
        ConvexCache cache;
        cache.size = static_cast<std::uint8_t>(seed % 6);
        for (VertexPair& p : cache.simplex) p = {index(random), index(random)};
        cache.last = {index(random), index(random)};
        ConvexWork work;
        const Touch cold = touching(a, b, m);
        ASSERT_EQ(hullsTouching(a, b, m, work, &cache), cold);
        ASSERT_EQ(hullsTouching(a, b, m, work, &cache), cold);
    }
}

}  // namespace
}  // namespace tessera
