#include "server/collision/mesh/TriangleTriangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/unit/collision/RationalOracle.h"

namespace tessera {
namespace {

using oracle::IntTriangle;
using oracle::Point;

TEST(TriangleTriangle, CrossingTouchingAndApart) {
    const Triangle flat{Vec3d(0, 0, 0), Vec3d(4, 0, 0), Vec3d(0, 4, 0)};
    EXPECT_TRUE(trianglesIntersect(flat, {Vec3d(1, 1, -1), Vec3d(1, 1, 1), Vec3d(2, 1, 1)})) << "pierced";
    EXPECT_TRUE(trianglesIntersect(flat, {Vec3d(1, 1, 0), Vec3d(1, 1, 1), Vec3d(2, 1, 1)})) << "a corner on the face";
    EXPECT_TRUE(trianglesIntersect(flat, {Vec3d(0, 0, 0), Vec3d(0, 0, 5), Vec3d(-1, 0, 5)})) << "a common corner";
    EXPECT_TRUE(trianglesIntersect(flat, {Vec3d(0, 0, 0), Vec3d(4, 0, 0), Vec3d(0, 0, 5)})) << "a common edge";
    EXPECT_TRUE(trianglesIntersect(flat, {Vec3d(1, 1, 0), Vec3d(9, 1, 0), Vec3d(1, 9, 0)})) << "coplanar, overlapping";
    EXPECT_TRUE(trianglesIntersect(flat, {Vec3d(1, 1, 0), Vec3d(1.5, 1, 0), Vec3d(1, 1.5, 0)})) << "coplanar, inside";
    EXPECT_FALSE(trianglesIntersect(flat, {Vec3d(3, 3, 0), Vec3d(9, 3, 0), Vec3d(3, 9, 0)})) << "coplanar, apart";
    EXPECT_FALSE(trianglesIntersect(flat, {Vec3d(1, 1, 1e-300), Vec3d(1, 1, 1), Vec3d(2, 1, 1)})) << "just above";
    EXPECT_FALSE(trianglesIntersect(flat, {Vec3d(3, 3, -1), Vec3d(3, 3, 1), Vec3d(5, 5, 0)})) << "beside";
}

/// All kinds of contact come up when the grid is small: about half of these pairs touch in a corner, an edge, a plane.
class SmallGrid : public testing::TestWithParam<int> {};

TEST_P(SmallGrid, AgreesWithExactPartsInEveryOrder) {
    std::mt19937 random(11);
    std::uniform_int_distribution<int> k(0, GetParam());
    int hits = 0, degenerate = 0;
    constexpr int kTrials = 120'000;
    for (int trial = 0; trial < kTrials; ++trial) {
        IntTriangle a, b;
        for (Point& p : a) p = {k(random), k(random), k(random)};
        for (Point& p : b) p = {k(random), k(random), k(random)};
        const bool truth = oracle::trianglesMeet(a, b);
        hits += truth;
        Triangle x = toDouble(a), y = toDouble(b);
        degenerate += isDegenerate(x);
        ASSERT_EQ(isDegenerate(x), oracle::isZero(oracle::cross(a[1] - a[0], a[2] - a[0])));
        ASSERT_EQ(trianglesIntersect(x, y), truth) << trial;
        ASSERT_EQ(trianglesIntersect(y, x), truth) << trial;
        std::rotate(x.begin(), x.begin() + 1, x.end());
        std::swap(y[0], y[2]);
        ASSERT_EQ(trianglesIntersect(x, y), truth) << trial;
    }
    EXPECT_GT(hits, kTrials / 20);
    EXPECT_LT(hits, kTrials - kTrials / 20);
    EXPECT_GT(degenerate, 20);
}

INSTANTIATE_TEST_SUITE_P(GridSizes, SmallGrid, testing::Values(1, 2, 3, 7));

TEST(TriangleTriangle, AllInOnePlaneOrOnOneLine) {
    std::mt19937 random(5);
    std::uniform_int_distribution<int> k(-3, 3);
    for (int trial = 0; trial < 60'000; ++trial) {
        // A skew plane (or, every third time, a skew line) of lattice points.
        const bool line = trial % 3 == 0;
        const auto next = [&] {
            const int u = k(random), v = line ? 0 : k(random);
            return Point{2 * u + v, u - 3 * v, 5 * u + v};
        };
        IntTriangle a, b;
        for (Point& p : a) p = next();
        for (Point& p : b) p = next();
        ASSERT_EQ(trianglesIntersect(toDouble(a), toDouble(b)), oracle::trianglesMeet(a, b)) << trial;
    }
}

TEST(TriangleTriangle, StaysExactWhereRoundingDecides) {
    // Triangles of 2^20 units that pass each other by one unit or less.
    std::mt19937_64 random(17);
    std::uniform_int_distribution<std::int64_t> big(-(1 << 20), 1 << 20);
    std::uniform_int_distribution<int> small(-1, 1);
    int hits = 0;
    for (int trial = 0; trial < 60'000; ++trial) {
        IntTriangle a, b;
        for (Point& p : a) p = {big(random), big(random), big(random)};
        // b's first corner lies within a unit of a's edge or face; the others on one side or anywhere.
        const Point middle{(a[0].x + a[1].x) / 2, (a[0].y + a[1].y) / 2, (a[0].z + a[1].z) / 2};
        b[0] = {middle.x + small(random), middle.y + small(random), middle.z + small(random)};
        b[1] = {big(random), big(random), big(random)};
        b[2] = {big(random), big(random), big(random)};
        const bool truth = oracle::trianglesMeet(a, b);
        hits += truth;
        ASSERT_EQ(trianglesIntersect(toDouble(a), toDouble(b)), truth) << trial;
        ASSERT_EQ(trianglesIntersect(toDouble(b), toDouble(a)), truth) << trial;
    }
    EXPECT_GT(hits, 10'000);
}

}  // namespace
}  // namespace tessera
