/// The frustum test against brute force: many points in many boxes.
#include "common/math/Frustum.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace tessera {
namespace {

/// An off-axis perspective clip matrix of the eye at `eye`.
Mat4d clipMatrix(std::mt19937_64& random) {
    std::uniform_real_distribution<double> u(0.2, 1.5);
    const double near = 0.1, far = 20;
    const double left = -u(random) * near, right = u(random) * near, bottom = -u(random) * near, top = u(random) * near;
    Mat4d projection = Mat4d::Zero();
    projection(0, 0) = 2 * near / (right - left);
    projection(0, 2) = (right + left) / (right - left);
    projection(1, 1) = 2 * near / (top - bottom);
    projection(1, 2) = (top + bottom) / (top - bottom);
    projection(2, 2) = -(far + near) / (far - near);
    projection(2, 3) = -2 * far * near / (far - near);
    projection(3, 2) = -1;
    const Quatd turn = Quatd(u(random), u(random), -u(random), u(random)).normalized();
    Affine3d eye_T_world = Affine3d::Identity();
    eye_T_world.linear() = turn.toRotationMatrix();
    eye_T_world.translation() = Vec3d(u(random), -u(random), u(random));
    return projection * eye_T_world.matrix();
}

bool insideClip(const Mat4d& clip, const Vec3d& point) {
    const Vec4d p = clip * point.homogeneous();
    return p.head<3>().cwiseAbs().maxCoeff() <= p.w();
}

Box randomBox(std::mt19937_64& random, double reach, double size) {
    std::uniform_real_distribution<double> u(-reach, reach), s(0.01, size);
    Box box;
    box.lower = Vec3d(u(random), u(random), u(random));
    box.upper = box.lower + Vec3d(s(random), s(random), s(random));
    return box;
}

Vec3d randomPointIn(const Box& box, std::mt19937_64& random) {
    std::uniform_real_distribution<double> u(0, 1);
    return box.lower + Vec3d(u(random), u(random), u(random)).cwiseProduct(box.size());
}

TEST(Frustum, NeverCallsABoxOutsideThatHasAPointInside) {
    std::mt19937_64 random(1);
    int outside = 0, inside = 0, crossing = 0;
    for (int i = 0; i < 3000; ++i) {
        const Mat4d clip = clipMatrix(random);
        const Frustum frustum = Frustum::fromClipMatrix(clip);
        const Box box = randomBox(random, 12, 6);
        const Frustum::Result result = frustum.classify(box);
        for (int k = 0; k < 30; ++k) {
            const bool in = insideClip(clip, randomPointIn(box, random));
            EXPECT_FALSE(result.outside && in);
            EXPECT_TRUE(in || result.outside || result.undecided != 0) << "no plane crosses it";
        }
        result.outside ? ++outside : result.undecided == 0 ? ++inside : ++crossing;
    }
    EXPECT_GT(outside, 300);
    EXPECT_GT(inside, 20);
    EXPECT_GT(crossing, 300);
}

TEST(Frustum, CallsABoxOutsideThatLiesBehindOnePlane) {
    std::mt19937_64 random(2);
    for (int i = 0; i < 2000; ++i) {
        const Mat4d clip = clipMatrix(random);
        const Frustum frustum = Frustum::fromClipMatrix(clip);
        const Box box = randomBox(random, 12, 2);
        bool behindOne = false;
        for (const Plane& plane : frustum.planes()) {
            bool all = true;
            for (int c = 0; c < 8; ++c) {
                const Vec3d corner(c & 1 ? box.upper.x() : box.lower.x(), c & 2 ? box.upper.y() : box.lower.y(),
                                   c & 4 ? box.upper.z() : box.lower.z());
                all = all && plane.normal.dot(corner) + plane.offset < 0;
            }
            behindOne = behindOne || all;
        }
        EXPECT_EQ(frustum.classify(box).outside, behindOne);
    }
}

TEST(Frustum, MaskPassedDownGivesTheSameAnswerForParts) {
    std::mt19937_64 random(3);
    int saved = 0;
    for (int i = 0; i < 2000; ++i) {
        const Frustum frustum = Frustum::fromClipMatrix(clipMatrix(random));
        const Box whole = randomBox(random, 10, 8);
        const Frustum::Result above = frustum.classify(whole);
        if (above.outside) continue;
        Box part;
        part.extend(randomPointIn(whole, random));
        part.extend(randomPointIn(whole, random));
        const Frustum::Result with = frustum.classify(part, above.undecided);
        EXPECT_EQ(with.outside, frustum.classify(part).outside);
        EXPECT_EQ(with.undecided & ~above.undecided, 0) << "planes that are done with stay done with";
        saved += 6 - std::popcount(above.undecided);
    }
    EXPECT_GT(saved, 1000);
}

TEST(Frustum, PlanesHaveUnitNormalsThatPointInwards) {
    std::mt19937_64 random(4);
    const Mat4d clip = clipMatrix(random);
    const Frustum frustum = Frustum::fromClipMatrix(clip);
    const Vec4d middle = clip.inverse() * Vec4d(0, 0, 0.5, 1);
    for (const Plane& plane : frustum.planes()) {
        EXPECT_NEAR(plane.normal.norm(), 1, 1e-12);
        EXPECT_GT(plane.normal.dot(middle.head<3>() / middle.w()) + plane.offset, 0);
    }
}

TEST(Frustum, EmptyBoxesAreOutside) {
    std::mt19937_64 random(5);
    EXPECT_TRUE(Frustum::fromClipMatrix(clipMatrix(random)).classify(Box()).outside);
}

TEST(Frustum, APlaneAtInfinityHoldsEverything) {
    Mat4d clip = Mat4d::Identity();
    clip.row(2).setZero();  // no near and no far plane: w ± z is 1
    Box far;
    far.extend(Vec3d(0, 0, 1e12));
    EXPECT_FALSE(Frustum::fromClipMatrix(clip).classify(far).outside);
}

}  // namespace
}  // namespace tessera
