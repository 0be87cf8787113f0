#include "common/math/Compose.h"
#include "server/collision/query/DistanceQuery.h"

#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "server/collision/mesh/TriangleContact.h"
#include "tests/unit/collision/BruteForce.h"
#include "tests/unit/collision/Shapes.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using bodies::anyRotation, bodies::between, bodies::inCube, bodies::meshOf, bodies::Random;

/// Triangles strewnThin over a thin shell, of all shapes: needles, slivers, points among them.
TriangleMesh strewnThin(Random& random, int faces, double size) {
    shapes::Soup soup;
    for (int i = 0; i < faces; ++i) {
        const Vec3d at = inCube(random, 1).normalized();
        const double kind = between(random, 0, 1);
        const Vec3d u = inCube(random, size), v = kind < 0.1    ? Vec3d(u * 0.5 + inCube(random, size * 1e-4))
                                                  : kind < 0.15 ? Vec3d(Vec3d::Zero())
                                                                : inCube(random, size);
        for (const Vec3d& p : {at, Vec3d(at + u), Vec3d(at + v)}) soup.vertex(p);
        for (std::uint32_t k = 0; k < 3; ++k) soup.indices.push_back(static_cast<std::uint32_t>(3 * i) + k);
    }
    return meshOf(soup);
}

/// Every face against every face.
double measured(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b) {
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t g = 0; g < b.faceCount(); ++g) {
        const Triangle t = transformed(a_T_b, b.triangle(g));
        for (std::uint32_t f = 0; f < a.faceCount(); ++f) {
            if (trianglesIntersect(a.triangle(f), t)) return 0;
            least = std::min(least, nearestPoints(a.triangle(f), t).distance);
        }
    }
    return least;
}

class DistanceOfKind : public testing::TestWithParam<VolumeKind> {};

TEST_P(DistanceOfKind, IsThatOfAllPairs) {
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const double size = seed % 3 == 0 ? 0.9 : seed % 3 == 1 ? 0.2 : 0.02;
        const TriangleTree a(strewnThin(random, 150, size), {GetParam()}),
            b(strewnThin(random, 90, size), {GetParam()});
        const double scale = seed % 5 == 4 ? 1e-3 : 1;
        Vec3d stretch = Vec3d::Constant(scale);
        if (seed % 4 == 1) stretch = scale * Vec3d(1, 0.3, 2);
        if (seed % 4 == 2) stretch = scale * Vec3d(1, -1, 1);
        if (seed % 4 == 3) stretch = scale * Vec3d(1, 1, 0);
        for (int pose = 0; pose < 4; ++pose) {
            const Vec3d way = inCube(random, 1).normalized() * between(random, 0.2, 4.5);
            const Affine3d a_T_b = composeTransform(way, anyRotation(random), stretch);
            QueryWork work;
            const Distance found = distanceBetween(a, b, a_T_b, work);
            ASSERT_TRUE(found.complete);
            ASSERT_FALSE(found.farther);
            EXPECT_EQ(found.distance, measured(a.mesh(), b.mesh(), a_T_b));
            EXPECT_NEAR((found.onA - found.onB).norm(), found.distance, 1e-15 + 1e-15 * way.norm());
            EXPECT_GT(work.boxTests, 0u);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Volumes, DistanceOfKind,
                         testing::Values(VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kObb, VolumeKind::kDop6,
                                         VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26));

/// A face whose corners are one point has no plane, and the bound of the search must not come from one.
TEST_P(DistanceOfKind, IsRightWhereFacesArePoints) {
    Random random(77);
    for (int trial = 0; trial < 400; ++trial) {
        SCOPED_TRACE("trial " + std::to_string(trial));
        const auto soup = [&] {
            shapes::Soup out;
            for (std::uint32_t i = 0; i < 8; ++i) {
                const Vec3d at = inCube(random, 1);
                for (std::uint32_t k = 0; k < 3; ++k) {
                    out.vertex(at + (i % 2 == 0 ? Vec3d(Vec3d::Zero()) : inCube(random, 0.3)));
                    out.indices.push_back(3 * i + k);
                }
            }
            return meshOf(out);
        };
        const TriangleTree a(soup(), {GetParam()}), b(soup(), {GetParam()});
        const Affine3d a_T_b = composeTransform(inCube(random, 3), anyRotation(random), Vec3d::Ones());
        QueryWork work;
        EXPECT_NEAR(distanceBetween(a, b, a_T_b, work).distance, measured(a.mesh(), b.mesh(), a_T_b), 1e-12);
    }
}

TEST(Distance, OfTreesOfDifferentVolumesIsThatOfAllPairs) {
    Random random(12);
    for (const VolumeKind kindA : bodies::kVolumes)
        for (const VolumeKind kindB : bodies::kVolumes) {
            const TriangleTree a(strewnThin(random, 60, 0.3), {kindA}), b(strewnThin(random, 90, 0.2), {kindB});
            const Affine3d a_T_b = composeTransform(inCube(random, 3), anyRotation(random), Vec3d::Ones());
            QueryWork work;
            const Distance found = distanceBetween(a, b, a_T_b, work);
            const Distance again =
                distanceBetween(b, a, a_T_b.inverse(), work, {.start = FacePair{found.faces.b, found.faces.a}});
            EXPECT_EQ(found.distance, measured(a.mesh(), b.mesh(), a_T_b));
            EXPECT_NEAR(again.distance, found.distance, 1e-13);
        }
}

TEST(Distance, OfBoxesIsTheGapBetweenTheirFaces) {
    const TriangleTree a(meshOf(shapes::box({2, 2, 2}))), b(meshOf(shapes::box({1, 1, 1})));
    QueryWork work;
    const Distance found =
        distanceBetween(a, b, composeTransform({2.25, 0, 0}, Quatd::Identity(), Vec3d::Ones()), work);
    EXPECT_EQ(found.distance, 0.75);
    EXPECT_EQ(found.onA.x(), 1);
    EXPECT_EQ(found.onB.x(), 1.75);
}

TEST(Distance, OfASmallBoxInsideABigOneIsThatOfTheirSurfaces) {
    const TriangleTree a(meshOf(shapes::box({4, 4, 4}))), b(meshOf(shapes::box({1, 1, 1})));
    QueryWork work;
    EXPECT_EQ(distanceBetween(a, b, Affine3d(Eigen::Translation3d(0.25, 0, 0)), work).distance, 1.25);
}

TEST(Distance, IsNothingWhereAPointPiercesTheMiddleOfAFace) {
    const TriangleTree sheet(meshOf(shapes::sheet(10, 10))), needle(meshOf(shapes::box({1e-3, 1e-3, 1})));
    QueryWork work;
    const Distance found =
        distanceBetween(sheet, needle, composeTransform({2, 1, 0.2}, Quatd::Identity(), Vec3d::Ones()), work);
    EXPECT_EQ(found.distance, 0);
    EXPECT_NEAR((found.onA - Vec3d(2, 1, 0)).norm(), 0, 2e-3);
}

TEST(Distance, IsTheSameWhicheverPairIsLookedAtFirst) {
    Random random(5);
    const TriangleTree a(strewnThin(random, 400, 0.1)), b(strewnThin(random, 400, 0.1));
    for (int pose = 0; pose < 50; ++pose) {
        const Affine3d a_T_b = composeTransform(Vec3d(2.4, 0, 0), anyRotation(random), Vec3d::Ones());
        QueryWork cold, warm;
        const Distance first = distanceBetween(a, b, a_T_b, cold);
        const Distance again = distanceBetween(a, b, a_T_b, warm, {.start = first.faces});
        const Distance elsewhere = distanceBetween(a, b, a_T_b, warm, {.start = FacePair{399, 7}});
        EXPECT_EQ(first.distance, again.distance);
        EXPECT_EQ(first.distance, elsewhere.distance);
    }
}

TEST(Distance, IsFoundWithLessWorkFromTheLastNearestPair) {
    Random random(6);
    const TriangleTree a(strewnThin(random, 4000, 0.05)), b(strewnThin(random, 4000, 0.05));
    const Affine3d a_T_b = composeTransform(Vec3d(2.4, 0.3, 0), anyRotation(random), Vec3d::Ones());
    QueryWork cold, warm;
    const Distance first = distanceBetween(a, b, a_T_b, cold);
    (void)distanceBetween(a, b, a_T_b, warm, {.start = first.faces});
    EXPECT_LT(warm.boxTests + warm.triangleTests, cold.boxTests + cold.triangleTests);
}

TEST(Distance, SaysWhenNothingIsNearerThanTheBound) {
    const TriangleTree a(meshOf(shapes::box({2, 2, 2}))), b(meshOf(shapes::box({1, 1, 1})));
    const Affine3d a_T_b(Eigen::Translation3d(2.25, 0, 0));
    QueryWork work;
    const Distance beyond = distanceBetween(a, b, a_T_b, work, {.upperBound = 0.5});
    EXPECT_TRUE(beyond.farther);
    EXPECT_EQ(beyond.distance, 0.5);
    const Distance within = distanceBetween(a, b, a_T_b, work, {.upperBound = 0.76});
    EXPECT_FALSE(within.farther);
    EXPECT_EQ(within.distance, 0.75);
}

TEST(Distance, OfAnEmptyMeshIsFarther) {
    const TriangleTree a(meshOf(shapes::box({2, 2, 2}))), none(TriangleMesh{});
    QueryWork work;
    EXPECT_TRUE(distanceBetween(a, none, Affine3d::Identity(), work).farther);
    EXPECT_TRUE(distanceBetween(none, a, Affine3d::Identity(), work).farther);
}

TEST(Distance, ErrsUpwardsByNoMoreThanTheTolerance) {
    Random random(8);
    const TriangleTree a(strewnThin(random, 2000, 0.1)), b(strewnThin(random, 2000, 0.1));
    for (const double tolerance : {1e-3, 1e-2, 0.1})
        for (int pose = 0; pose < 20; ++pose) {
            const Affine3d a_T_b = composeTransform(Vec3d(2.5, 0, 0), anyRotation(random), Vec3d::Ones());
            QueryWork exact, loose;
            const double d = distanceBetween(a, b, a_T_b, exact).distance;
            const double about = distanceBetween(a, b, a_T_b, loose, {.tolerance = tolerance}).distance;
            EXPECT_GE(about, d);
            EXPECT_LE(about, d + tolerance);
        }
}

TEST(Distance, GivesALowerBoundWhenItsWorkIsExhausted) {
    Random random(9);
    const TriangleTree a(strewnThin(random, 2000, 0.1)), b(strewnThin(random, 2000, 0.1));
    const Affine3d a_T_b = composeTransform(Vec3d(2.5, 0, 0), anyRotation(random), Vec3d::Ones());
    QueryWork all;
    const double d = distanceBetween(a, b, a_T_b, all).distance;
    double last = 0;
    for (std::uint64_t limit = 1; limit < all.boxTests + all.triangleTests; limit = limit * 3 / 2 + 1) {
        QueryWork work{.limit = limit};
        const Distance found = distanceBetween(a, b, a_T_b, work);
        if (found.complete) continue;
        EXPECT_LE(found.distance, d);
        EXPECT_GE(found.distance, 0);
        last = std::max(last, found.distance);
    }
    EXPECT_GT(last, 0) << "a bound that is always 0 says nothing";
}

TEST(Distance, HoldsFarFromTheOriginAndInAnyUnit) {
    Random random(10);
    for (const double unit : {1e-20, 1e-6, 1.0, 1e6, 1e20}) {
        SCOPED_TRACE(unit);
        shapes::Soup box = shapes::box(Vec3d::Constant(unit)), same = box;
        const TriangleTree a(meshOf(box)), b(meshOf(same));
        QueryWork work;
        const Distance found = distanceBetween(a, b, Affine3d(Eigen::Translation3d(3 * unit, 0, 0)), work);
        EXPECT_NEAR(found.distance / unit, 2, 1e-6);
        EXPECT_EQ(found.distance, measured(a.mesh(), b.mesh(), Affine3d(Eigen::Translation3d(3 * unit, 0, 0))));
    }
    shapes::Soup away = shapes::box({1, 1, 1});
    for (float& x : away.positions) x += 4096;
    const TriangleTree a(meshOf(away)), b(meshOf(shapes::box({1, 1, 1})));
    QueryWork work;
    EXPECT_EQ(distanceBetween(a, b, Affine3d(Eigen::Translation3d(4096, 4096, 4098.5)), work).distance, 1.5);
}

TEST(Distance, IsSymmetric) {
    Random random(11);
    const TriangleTree a(strewnThin(random, 300, 0.2)), b(strewnThin(random, 300, 0.2));
    for (int pose = 0; pose < 30; ++pose) {
        const Affine3d a_T_b = composeTransform(Vec3d(2.5, 0, 0), anyRotation(random), Vec3d::Ones());
        QueryWork work;
        EXPECT_NEAR(distanceBetween(a, b, a_T_b, work).distance, distanceBetween(b, a, a_T_b.inverse(), work).distance,
                    1e-13);
    }
}

}  // namespace
}  // namespace tessera
