#include <gtest/gtest.h>

#include "server/collision/convex/ConvexQuery.h"
#include "tests/unit/convex/ConvexBruteForce.h"
#include "tests/unit/convex/ConvexShapes.h"

namespace tessera {
namespace {

using convextest::hullOf;
using convextest::Points;
using convextest::Random;

HullDepth depthOf(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b = Affine3d::Identity()) {
    ConvexWork work;
    return hullDepth(a, b, a_T_b, work);
}

TEST(HullDepth, OfBoxesIsTheShortestWayOut) {
    const ConvexHull box = hullOf(convextest::box(Vec3d(4, 2, 2)));
    const HullDepth side = depthOf(box, box, Affine3d(Eigen::Translation3d(3.75, 0, 0)));
    EXPECT_TRUE(side.touching);
    EXPECT_DOUBLE_EQ(side.depth, 0.25);
    EXPECT_EQ(side.normal, Vec3d(1, 0, 0)) << "from A to B";
    EXPECT_DOUBLE_EQ(side.onA.x(), 2);
    EXPECT_DOUBLE_EQ(side.onB.x(), 1.75);
    EXPECT_DOUBLE_EQ(depthOf(box, box).depth, 2);
    const HullDepth touching = depthOf(box, box, Affine3d(Eigen::Translation3d(4, 1, 0)));
    EXPECT_TRUE(touching.touching);
    EXPECT_NEAR(touching.depth, 0, 1e-15);
    EXPECT_LT((touching.onA - touching.onB).norm(), 1e-15);
    const HullDepth apart = depthOf(box, box, Affine3d(Eigen::Translation3d(0, 0, 5)));
    EXPECT_FALSE(apart.touching);
    EXPECT_DOUBLE_EQ(apart.depth, -3);
    EXPECT_EQ(apart.normal, Vec3d(0, 0, 1));
}

TEST(HullDepth, OfSpheresIsNearlyThatOfBalls) {
    Random random(2);
    const ConvexHull sphere = hullOf(convextest::sphere(1, 2000));
    for (int i = 0; i < 60; ++i) {
        const double depth = 0.01 + 0.03 * i;
        const Vec3d way = convextest::unitVector(random);
        const HullDepth d = depthOf(sphere, sphere, Affine3d(Eigen::Translation3d((2 - depth) * way)));
        ASSERT_TRUE(d.complete);
        EXPECT_NEAR(d.depth, depth, 0.01);
        EXPECT_LE(d.depth, depth + 1e-12);
        EXPECT_TRUE(depth > 1 || d.normal.dot(way) > 0.98);
    }
}

/// What a depth promises, by brute force.
void expectDepth(const ConvexHull& a, const ConvexHull& b, const Affine3d& m, const HullDepth& d, double truth) {
    const double size = a.bounds().size().norm() + (m * b.centre()).norm() + (m.linear() * b.bounds().size()).norm();
    ASSERT_TRUE(d.complete);
    ASSERT_NEAR(d.normal.norm(), 1, 1e-14);
    ASSERT_NEAR(convextest::extent(a, b, m, d.normal), d.depth, 1e-13 * size) << "moved by it, they just touch";
    ASSERT_NEAR(d.depth, truth, 1e-12 * size) << "and no shorter way does";
    ASSERT_LT((d.onA - d.onB - d.depth * d.normal).norm(), 1e-10 * size);
    ConvexWork work;
    const Affine3d free = Eigen::Translation3d((d.depth + 1e-12 * size) * d.normal) * m;
    ASSERT_EQ(hullsTouching(a, b, free, work), Touch::kNo);
    ASSERT_LT(hullDistance(a, hullOf({d.onA}), Affine3d::Identity(), work).distance, 1e-12 * size);
    ASSERT_LT(hullDistance(hullOf({d.onB}), b, m, work).distance, 1e-12 * size);
}

TEST(HullDepth, IsTheLeastOverAllSidesAndEdges) {
    int deep = 0;
    for (int seed = 0; seed < 1500; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        constexpr int kKinds[] = {0, 1, 2, 4, 8};
        const ConvexHull a = hullOf(convextest::anyBody(kKinds[seed % 5], random));
        const ConvexHull b = hullOf(convextest::anyBody(kKinds[seed / 5 % 5], random));
        Affine3d m = Affine3d(Eigen::Translation3d(0.7 * convextest::normalVector(random)));
        if (seed % 3 != 0) m.rotate(convextest::rotation(random));  // else edges and sides are parallel
        if (seed % 7 == 1) m.scale((0.2 + convextest::normalVector(random).cwiseAbs().array()).matrix());
        const HullDepth d = depthOf(a, b, m);
        if (!d.touching) continue;
        expectDepth(a, b, m, d, convextest::bruteDepth(a, b, m));
        if (HasFatalFailure()) return;
        ++deep;
    }
    EXPECT_GT(deep, 700);
}

TEST(HullDepth, OfFlatThingsInBodies) {
    int deep = 0;
    for (int seed = 0; seed < 600; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const ConvexHull a = hullOf(convextest::anyBody(seed % 3, random));
        const ConvexHull b = hullOf(convextest::anyBody(5 + seed / 3 % 3, random));
        Affine3d m = Affine3d(Eigen::Translation3d(0.3 * convextest::normalVector(random)));
        if (seed % 2) m.rotate(convextest::rotation(random));
        const HullDepth d = depthOf(a, b, m);
        if (!d.touching) continue;
        expectDepth(a, b, m, d, convextest::bruteDepth(a, b, m));
        if (HasFatalFailure()) return;
        ++deep;
    }
    EXPECT_GT(deep, 200);
}

TEST(HullDepth, OfFlatThingsInEachOtherIsNone) {
    Random random(6);
    const ConvexHull polygon = hullOf(convextest::anyBody(5, random));
    for (int i = 0; i < 100; ++i) {
        // In the same plane, turned in it by an angle that is not exact; then as a whole anywhere.
        const Affine3d inPlane =
            Affine3d(Eigen::Translation3d(0.2, 0.1, 0)) * Eigen::AngleAxisd(0.1 * i, Vec3d::UnitZ());
        const HullDepth d = depthOf(polygon, polygon, inPlane);
        ASSERT_TRUE(d.touching);
        EXPECT_LT(d.depth, 1e-14);
        EXPECT_GT(std::abs(d.normal.z()), 1 - 1e-6);
        EXPECT_LT((d.onA - d.onB).norm(), 1e-12);
    }
    const ConvexHull point = hullOf({Vec3d(1, 2, 3)}), segment = hullOf({Vec3d(0, 0, 0), Vec3d(2, 4, 6)});
    const HullDepth same = depthOf(point, point);
    EXPECT_TRUE(same.touching);
    EXPECT_EQ(same.depth, 0);
    const HullDepth on = depthOf(segment, point);
    EXPECT_TRUE(on.touching);
    EXPECT_NEAR(on.depth, 0, 1e-15);
    EXPECT_LT(std::abs(on.normal.dot(Vec3d(1, 2, 3))), 1e-12);
    EXPECT_NEAR(depthOf(segment, segment).depth, 0, 1e-15);
}

TEST(HullDepth, DeepInsideARoundBody) {
    Random random(9);
    const ConvexHull outer = hullOf(convextest::sphere(10, 1000)), inner = hullOf(convextest::anyBody(2, random));
    for (int i = 0; i < 20; ++i) {
        const Affine3d m =
            Affine3d(Eigen::Translation3d(i * 0.2 * convextest::unitVector(random))) * convextest::rotation(random);
        const HullDepth d = depthOf(outer, inner, m);
        ASSERT_TRUE(d.complete);
        EXPECT_NEAR(convextest::extent(outer, inner, m, d.normal), d.depth, 1e-12);
        // A cloud of directions finds nothing shorter.
        for (int k = 0; k < 3000; ++k)
            ASSERT_GT(convextest::extent(outer, inner, m, convextest::unitVector(random)), d.depth - 1e-12);
    }
}

TEST(HullDepth, SaysSoWhereItGaveUpAndStillLeadsOut) {
    const ConvexHull sphere = hullOf(convextest::sphere(1, 3000));
    ConvexWork work;
    const HullDepth capped = hullDepth(sphere, sphere, Affine3d::Identity(), work, nullptr, {.maxSupports = 20});
    EXPECT_FALSE(capped.complete);
    EXPECT_NEAR(capped.depth, convextest::extent(sphere, sphere, Affine3d::Identity(), capped.normal), 1e-14);
    EXPECT_LE(capped.depth, 2);
    EXPECT_LT(work.supports, 60u);
    ConvexWork loose;
    const HullDepth near = hullDepth(sphere, sphere, Affine3d::Identity(), loose, nullptr, {.tolerance = 0.05});
    EXPECT_TRUE(near.complete);
    EXPECT_NEAR(near.depth, 2, 0.06);
    EXPECT_LT(loose.supports, 600u);
}

TEST(HullDepth, IsReversedSeenFromTheOther) {
    for (int seed = 0; seed < 300; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const ConvexHull a = hullOf(convextest::anyBody(2, random)), b = hullOf(convextest::anyBody(9, random));
        const Affine3d m =
            Affine3d(Eigen::Translation3d(convextest::normalVector(random))) * convextest::rotation(random);
        const HullDepth d = depthOf(a, b, m), swapped = depthOf(b, a, m.inverse());
        ASSERT_NEAR(d.depth, swapped.depth, 1e-12);
        ASSERT_TRUE(std::abs(d.depth) < 1e-6 || (d.normal + m.linear() * swapped.normal).norm() < 1e-6);
    }
}

}  // namespace
}  // namespace tessera
