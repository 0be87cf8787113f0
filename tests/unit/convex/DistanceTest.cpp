#include <gtest/gtest.h>

#include "server/collision/convex/ConvexQuery.h"
#include "tests/unit/convex/ConvexBruteForce.h"
#include "tests/unit/convex/ConvexShapes.h"

namespace tessera {
namespace {

using convextest::hullOf;
using convextest::Points;
using convextest::Random;

HullDistance distanceOf(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b = Affine3d::Identity()) {
    ConvexWork work;
    return hullDistance(a, b, a_T_b, work);
}

TEST(HullDistance, OfBoxesCornerEdgeAndSide) {
    const ConvexHull unit = hullOf(convextest::box(Vec3d(1, 1, 1)));
    const auto at = [](double x, double y, double z) { return Affine3d(Eigen::Translation3d(x, y, z)); };
    EXPECT_EQ(distanceOf(unit, unit, at(3, 0.2, 0.1)).distance, 2);
    EXPECT_DOUBLE_EQ(distanceOf(unit, unit, at(4, 5, 0)).distance, 5);
    const HullDistance corners = distanceOf(unit, unit, at(3, 3, 2));
    EXPECT_DOUBLE_EQ(corners.distance, 3);
    EXPECT_EQ(corners.onA, Vec3d(0.5, 0.5, 0.5));
    EXPECT_EQ(corners.onB, Vec3d(2.5, 2.5, 1.5));
    EXPECT_EQ(distanceOf(unit, unit, at(0.5, 0, 0)).distance, 0);
}

TEST(HullDistance, OfATetrahedronAndACorner) {
    const ConvexHull tetrahedron = hullOf({Vec3d(0, 0, 0), Vec3d(3, 0, 0), Vec3d(0, 3, 0), Vec3d(0, 0, 3)});
    const ConvexHull point = hullOf({Vec3d(4, 4, 4)});
    // The slanted side lies in x + y + z = 3.
    const HullDistance d = distanceOf(tetrahedron, point);
    EXPECT_NEAR(d.distance, 9 / std::sqrt(3.0), 1e-14);
    EXPECT_LT((d.onA - Vec3d(1, 1, 1)).norm(), 1e-14);
    EXPECT_EQ(d.onB, Vec3d(4, 4, 4));
    EXPECT_DOUBLE_EQ(distanceOf(hullOf({Vec3d(1, 1, 1)}), point).distance, std::sqrt(27.0));
}

TEST(HullDistance, OfSpheresIsBelowTheirCentresDistance) {
    const ConvexHull sphere = hullOf(convextest::sphere(1, 5000));
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const double gap = std::pow(10.0, -3 + i % 5);
        const Affine3d m =
            Affine3d(Eigen::Translation3d((2 + gap) * convextest::unitVector(random))) * convextest::rotation(random);
        const HullDistance d = distanceOf(sphere, sphere, m);
        EXPECT_GE(d.distance, gap - 1e-14);
        EXPECT_LE(d.distance, gap + 4e-3) << "sides lie within 2e-3 of the sphere";
    }
}

/// Nearest points are in the hulls, at the distance; and no other triangle pair is nearer.
void expectNearest(const ConvexHull& a, const ConvexHull& b, const Affine3d& m, const HullDistance& d) {
    ASSERT_TRUE(d.complete);
    const double truth = convextest::bruteDistance(a, b, m);
    const double size = a.bounds().size().norm() + (m * b.centre()).norm() + (m.linear() * b.bounds().size()).norm();
    ASSERT_NEAR(d.distance, truth, 1e-12 * truth + 1e-14 * size);
    ASSERT_NEAR((d.onA - d.onB).norm(), d.distance, 1e-14 * size);
    const ConvexHull onA = hullOf({d.onA}), onB = hullOf({d.onB});
    ASSERT_LT(distanceOf(a, onA).distance, 1e-13 * size);
    ASSERT_LT(distanceOf(onB, b, m).distance, 1e-13 * size);
}

class AnyBodies : public testing::TestWithParam<int> {};

TEST_P(AnyBodies, AreAsFarApartAsTheirTriangles) {
    const int kindA = GetParam() / 10, kindB = GetParam() % 10;
    int apart = 0;
    for (int seed = 0; seed < 25; ++seed) {
        SCOPED_TRACE(testing::Message() << "kinds " << kindA << " " << kindB << ", seed " << seed);
        Random random(static_cast<std::uint64_t>(seed + 100 * GetParam()));
        const ConvexHull a = hullOf(convextest::anyBody(kindA, random));
        const ConvexHull b = hullOf(convextest::anyBody(kindB, random));
        Affine3d m = Affine3d(Eigen::Translation3d((1 + seed % 5) * convextest::normalVector(random)));
        m.rotate(convextest::rotation(random));
        if (seed % 4 == 1) m.scale(convextest::normalVector(random));
        if (seed % 4 == 2) m.linear() = Mat3d::Identity();
        const bool truth = convextest::bruteTouching(a, b, m);
        ConvexWork work;
        ASSERT_EQ(hullsTouching(a, b, m, work), truth ? Touch::kYes : Touch::kNo);
        const HullDistance d = distanceOf(a, b, m);
        ASSERT_EQ(d.distance == 0, truth);
        if (!truth) expectNearest(a, b, m, d);
        if (HasFatalFailure()) return;
        apart += !truth;
    }
    EXPECT_GT(apart, 2);
}

INSTANTIATE_TEST_SUITE_P(Kinds, AnyBodies, testing::Range(0, 100));

TEST(HullDistance, IsRightWhenTheyAlmostTouch) {
    for (int seed = 0; seed < 600; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const ConvexHull a = hullOf(convextest::anyBody(seed % 5, random));
        const ConvexHull b = hullOf(convextest::anyBody(seed / 5, random));
        Affine3d m = Affine3d(Eigen::Translation3d(40 * convextest::unitVector(random))) * convextest::rotation(random);
        const HullDistance far = distanceOf(a, b, m);
        ASSERT_GT(far.distance, 0);
        // Along the shortest way, down to a gap of 1e-2 … 1e-17.
        const Vec3d way = (far.onA - far.onB).normalized();
        const double gap = std::pow(10.0, -2 - seed % 16);
        m.pretranslate((far.distance - gap) * way);
        const HullDistance near = distanceOf(a, b, m);
        ASSERT_NEAR(near.distance, gap, 1e-14 * 40);
        if (near.distance == 0) continue;
        ASSERT_NEAR(near.distance, convextest::bruteDistance(a, b, m), 1e-14 * 40);
    }
}

TEST(HullDistance, IsTheSameSeenFromTheOther) {
    for (int seed = 0; seed < 500; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const ConvexHull a = hullOf(convextest::anyBody(seed, random)),
                         b = hullOf(convextest::anyBody(seed / 10, random));
        const Affine3d m =
            Affine3d(Eigen::Translation3d(5 * convextest::normalVector(random))) * convextest::rotation(random);
        const HullDistance d = distanceOf(a, b, m), swapped = distanceOf(b, a, m.inverse());
        ASSERT_NEAR(d.distance, swapped.distance, 1e-13 * (1 + d.distance));
        // Both bodies moved together.
        const Affine3d common =
            Affine3d(Eigen::Translation3d(convextest::normalVector(random))) * convextest::rotation(random);
        const ConvexHull movedA = hullOf(convextest::moved(common, {a.vertices().begin(), a.vertices().end()}));
        ASSERT_NEAR(d.distance, distanceOf(movedA, b, common * m).distance, 1e-13 * (1 + d.distance));
        // All of it twice as large: every rounding is the same.
        const Affine3d twice(Eigen::Scaling(2.0));
        const ConvexHull largeA = hullOf(convextest::moved(twice, {a.vertices().begin(), a.vertices().end()}));
        const ConvexHull largeB = hullOf(convextest::moved(twice, {b.vertices().begin(), b.vertices().end()}));
        Affine3d larger = m;
        larger.translation() *= 2;
        ASSERT_EQ(2 * d.distance, distanceOf(largeA, largeB, larger).distance);
    }
}

TEST(HullDistance, FarFromTheOriginAndOfAnySize) {
    for (int seed = 0; seed < 400; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        const double size = std::pow(10.0, -20 + seed % 41);
        const Affine3d scale(Eigen::Scaling(size));
        const ConvexHull a = hullOf(convextest::moved(scale, convextest::anyBody(seed, random)));
        const ConvexHull b = hullOf(convextest::moved(scale, convextest::anyBody(seed / 7, random)));
        const Affine3d m =
            Affine3d(Eigen::Translation3d(40 * size * convextest::unitVector(random))) * convextest::rotation(random);
        const HullDistance d = distanceOf(a, b, m);
        const double truth = convextest::bruteDistance(a, b, m);
        ASSERT_NEAR(d.distance / size, truth / size, 1e-12);
    }
}

}  // namespace
}  // namespace tessera
