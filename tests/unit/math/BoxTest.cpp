#include "common/math/Box.h"

#include <gtest/gtest.h>

#include <random>

#include "common/math/Compose.h"

namespace tessera {
namespace {

Box boxOf(const Vec3d& lower, const Vec3d& upper) {
    Box box;
    box.lower = lower;
    box.upper = upper;
    return box;
}

TEST(Box, BeginsEmptyAndGrows) {
    Box box;
    EXPECT_TRUE(box.empty());
    box.extend(Vec3d(1, 2, 3));
    EXPECT_FALSE(box.empty()) << "one point is a box";
    EXPECT_EQ(box.size(), Vec3d::Zero().eval());
    box.extend(Vec3d(-1, 5, 3));
    EXPECT_EQ(box.lower, Vec3d(-1, 2, 3));
    EXPECT_EQ(box.upper, Vec3d(1, 5, 3));
    EXPECT_EQ(box.center(), Vec3d(0, 3.5, 3));
    box.extend(Box());
    EXPECT_EQ(box.upper, Vec3d(1, 5, 3)) << "an empty box adds nothing";
}

TEST(Box, CountsTouchingAsOverlap) {
    const Box box = boxOf({0, 0, 0}, {1, 1, 1});
    EXPECT_TRUE(box.overlaps(boxOf({1, 1, 1}, {2, 2, 2})));
    EXPECT_FALSE(box.overlaps(boxOf({1.001, 0, 0}, {2, 1, 1})));
    EXPECT_FALSE(box.overlaps(boxOf({0, 0, -3}, {1, 1, -0.001})));
    EXPECT_TRUE(box.overlaps(boxOf({0.4, 0.4, 0.4}, {0.5, 0.5, 0.5})));
    EXPECT_FALSE(box.overlaps(Box()));
    EXPECT_TRUE(box.contains(Vec3d(1, 0, 0.5)));
    EXPECT_FALSE(box.contains(Vec3d(1, 0, 1.5)));
    EXPECT_FALSE(Box().contains(Vec3d::Zero()));
}

TEST(Box, TransformedIsTheTightBoxAroundItsCorners) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> u(-3, 3);
    for (int i = 0; i < 200; ++i) {
        Box box;
        box.extend(Vec3d(u(random), u(random), u(random)));
        box.extend(Vec3d(u(random), u(random), u(random)));
        const Quatd rotation = Quatd(u(random), u(random), u(random), u(random)).normalized();
        const Affine3d m =
            composeTransform({u(random), u(random), u(random)}, rotation, {u(random), u(random), u(random)});
        Box corners;
        for (int c = 0; c < 8; ++c) {
            corners.extend(Vec3d(m * Vec3d(c & 1 ? box.upper.x() : box.lower.x(), c & 2 ? box.upper.y() : box.lower.y(),
                                           c & 4 ? box.upper.z() : box.lower.z())));
        }
        const Box transformed = box.transformed(m);
        EXPECT_LT((transformed.lower - corners.lower).norm(), 1e-12);
        EXPECT_LT((transformed.upper - corners.upper).norm(), 1e-12);
    }
    EXPECT_TRUE(Box().transformed(Affine3d::Identity()).empty());
}

TEST(ComposeTransform, ScalesThenTurnsThenMoves) {
    const Affine3d m =
        composeTransform({10, 0, 0}, Quatd(Eigen::AngleAxisd(std::acos(-1.0) / 2, Vec3d::UnitZ())), {2, 3, 4});
    EXPECT_LT((m * Vec3d(1, 0, 0) - Vec3d(10, 2, 0)).norm(), 1e-12);
    EXPECT_LT((m * Vec3d(0, 1, 0) - Vec3d(7, 0, 0)).norm(), 1e-12);
    Quatd doubled = Quatd::Identity();
    doubled.coeffs() *= 2;
    EXPECT_LT((composeTransform(Vec3d::Zero(), doubled, Vec3d::Ones()) * Vec3d(1, 2, 3) - Vec3d(1, 2, 3)).norm(), 1e-12)
        << "a rotation need not be normalised";
}

}  // namespace
}  // namespace tessera
