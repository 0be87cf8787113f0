#include "server/collision/mesh/Predicates.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/collision/RationalOracle.h"

namespace tessera {
namespace {

using oracle::Point;
using oracle::Wide;

TEST(Predicates, TellTheSidesOfAPlaneAndALine) {
    const Vec3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
    EXPECT_EQ(orient3d(a, b, c, Vec3d(0.2, 0.2, 1)), 1);
    EXPECT_EQ(orient3d(a, b, c, Vec3d(0.2, 0.2, -1)), -1);
    EXPECT_EQ(orient3d(a, b, c, Vec3d(7, -3, 0)), 0);
    EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, 1}), 1);
    EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, -1}), -1);
    EXPECT_EQ(orient2d({0, 0}, {0.1, 0.1}, {0.3, 0.3}), 0);
}

TEST(Predicates, SeeOneUnitInTheLastPlaceOffTheLine) {
    // Kettner et al., "Classroom examples of robustness problems", 2008: the naive sign is wrong all over this grid.
    const double ulp = std::ldexp(1.0, -53);
    for (int i = 0; i < 128; ++i)
        for (int j = 0; j < 128; ++j) {
            const Vec2d p(0.5 + i * ulp, 0.5 + j * ulp);
            EXPECT_EQ(orient2d(p, Vec2d(12, 12), Vec2d(24, 24)), j > i ? 1 : (j < i ? -1 : 0)) << i << ' ' << j;
        }
}

TEST(Predicates, AgreeWithIntegersOnNearlyFlatTetrahedra) {
    // Needles of 40 bits that lie in one plane but for a unit or two: the products have 100 bits and more, the sum of
    // them half as many.
    std::mt19937_64 random(7);
    std::uniform_int_distribution<std::int64_t> coordinate(-(std::int64_t{1} << 29), std::int64_t{1} << 29);
    std::uniform_int_distribution<int> small(-2, 2), factor(-400, 400);
    int zeros = 0, naiveRight = 0;
    constexpr int kTrials = 100'000;
    for (int trial = 0; trial < kTrials; ++trial) {
        const Point a{coordinate(random), coordinate(random), coordinate(random)};
        const Point u{coordinate(random), coordinate(random), coordinate(random)};
        const auto near = [&](Wide s) {
            return Point{a.x + s * u.x + small(random), a.y + s * u.y + small(random), a.z + s * u.z + small(random)};
        };
        const Point b = near(factor(random)), c = near(factor(random)), d = near(factor(random));
        const int truth = oracle::orient3d(a, b, c, d);
        const Vec3d fa = toDouble(a), fb = toDouble(b), fc = toDouble(c), fd = toDouble(d);
        ASSERT_EQ(orient3d(fa, fb, fc, fd), truth) << trial;
        ASSERT_EQ(orient3d(fb, fa, fc, fd), -truth) << trial;
        zeros += truth == 0;
        const double naive = (fd - fa).dot((fb - fa).cross(fc - fa));
        naiveRight += (naive > 0 ? 1 : (naive < 0 ? -1 : 0)) == truth;
    }
    EXPECT_GT(zeros, 100);
    EXPECT_LT(naiveRight, kTrials * 9 / 10) << "the stress is no stress: plain arithmetic would do";
}

TEST(Predicates, AreExactFarFromTheOriginAndAtTinyScales) {
    // The differences themselves round here: 2^60 apart, one unit off.
    const Vec3d far(std::ldexp(1.0, 60), std::ldexp(1.0, 60), 0);
    EXPECT_EQ(orient3d(Vec3d(0, 0, 0), far, Vec3d(0, 0, 1), Vec3d(1, 1, 5)), 0);
    EXPECT_NE(orient3d(Vec3d(0, 0, 0), far, Vec3d(0, 0, 1), Vec3d(1, std::nextafter(1.0, 2.0), 5)), 0);
    const double tiny = 1e-50;
    EXPECT_EQ(orient3d(Vec3d(0, 0, 0), Vec3d(tiny, 0, 0), Vec3d(0, tiny, 0), Vec3d(0, 0, tiny)), 1);
    EXPECT_EQ(orient3d(Vec3d(0, 0, 0), Vec3d(1e50, 0, 0), Vec3d(0, 1e50, 0), Vec3d(1e50, 1e50, 0)), 0);
}

TEST(Predicates, AgreeOnShiftedGridsWithTheIntegerGrid) {
    // A small grid around an offset that eats most of the mantissa: (offset + k * step) is exact, its products are not.
    std::mt19937 random(3);
    std::uniform_int_distribution<int> k(-6, 6);
    const double offset = 1048576.0, step = std::ldexp(1.0, -32);
    const auto place = [&](const Point& p) -> Vec3d { return Vec3d::Constant(offset) + step * toDouble(p); };
    for (int trial = 0; trial < 100'000; ++trial) {
        std::array<Point, 4> p;
        for (Point& q : p) q = {k(random), k(random), k(random)};
        ASSERT_EQ(orient3d(place(p[0]), place(p[1]), place(p[2]), place(p[3])),
                  oracle::orient3d(p[0], p[1], p[2], p[3]));
        const auto flat = [](const Vec3d& v) { return Vec2d(v.head<2>()); };
        const Wide area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
        ASSERT_EQ(orient2d(flat(place(p[0])), flat(place(p[1])), flat(place(p[2]))), oracle::sign(area));
    }
}

}  // namespace
}  // namespace tessera
