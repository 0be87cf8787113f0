// Bad numbers, degenerate bodies, bounded work: a defined answer or a refusal.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/Compose.h"
#include "tests/unit/freeform_query/SmoothBodies.h"

namespace tessera::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

TEST(FreeformShape, RefusesWhatIsNoSurface) {
    Chance chance(1);
    ControlMesh cube = lumpyCube(chance, 1, 0.2);
    ControlMesh bad = cube;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        for (const double number : {kNaN, kInfinity, -1e60}) {
            bad = cube;
            bad.positions[3][axis] = number;
            EXPECT_FALSE(FreeformShape::ofSubdivision(bad)) << axis << " " << number;
        }
    bad = cube;
    bad.scheme = SubdivisionScheme::kBilinear;
    EXPECT_FALSE(FreeformShape::ofSubdivision(bad));
    bad = cube;
    for (std::uint32_t f = 0; f < 6; ++f) bad.holes.push_back(f);
    EXPECT_FALSE(FreeformShape::ofSubdivision(bad));
    EXPECT_FALSE(FreeformShape::ofSubdivision({}));
    EXPECT_FALSE(FreeformShape::ofTriangles({}));
    EXPECT_FALSE(FreeformShape::ofNurbs({}));
    EXPECT_FALSE(FreeformShape::ofHull(ConvexHull::make(std::vector<Vec3d>{Vec3d::Zero(), Vec3d::UnitX()}).value()));
    FreeformShape shape = FreeformShape::ofSubdivision(cube).value();
    std::vector<Vec3d> moved = cube.positions;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        moved = cube.positions;
        moved[0][axis] = kNaN;
        EXPECT_FALSE(shape.move(moved));
        EXPECT_FALSE(shape.move(std::vector<std::uint32_t>{0}, std::span(moved).first(1)));
        EXPECT_FALSE(shape.withPositions(moved));
        moved[0][axis] = kInfinity;
        EXPECT_FALSE(shape.move(moved));
    }
    EXPECT_FALSE(shape.move(std::span(moved).first(3)));
    EXPECT_FALSE(shape.move(std::vector<std::uint32_t>{99}, std::vector<Vec3d>{Vec3d::Zero()}));
    EXPECT_FALSE(shape.move(std::vector<std::uint32_t>{1, 2}, std::vector<Vec3d>{Vec3d::Zero()}));
    EXPECT_EQ(shape.moves(), 0U) << "nothing has changed";
}

TEST(FreeformQueries, NumbersThatAreNoneAreUnknown) {
    const FreeformShape a = sphere(1), b = sphere(1);
    FreeformPair pair(a, b);
    for (int entry = 0; entry < 24; ++entry) {
        const double bad = entry < 12 ? kNaN : kInfinity;
        Affine3d pose = Affine3d::Identity();
        pose.matrix()(entry % 3, entry % 12 / 3) = bad;
        QueryWork work;
        EXPECT_EQ(pair.touch(pose, 1e-4, work).touch, Touch::kUnknown);
        EXPECT_EQ(pair.touch(Affine3d::Identity(), bad, work).touch, Touch::kUnknown);
        EXPECT_FALSE(pair.distance(pose, work).complete);
        EXPECT_FALSE(pair.contacts(pose, work).complete);
        BodyMotion still, moving;
        moving.end.translation.y() = bad;
        const FreeformImpact hit = pair.firstContact(still, moving, 1e-4, work);
        EXPECT_FALSE(hit.complete);
        EXPECT_EQ(hit.t, 0);
    }
}

TEST(FreeformQueries, WhatIsFlattenedStillMeetsThings) {
    const FreeformShape a = sphere(1), b = sphere(1);
    FreeformPair pair(a, b);
    QueryWork work;
    for (const Vec3d& scale : {Vec3d(1, 1, 0), Vec3d(0, 0, 0), Vec3d(-1, 1, 1), Vec3d(2, 0.5, 0)}) {
        Affine3d pose = composeTransform({0, 0, 0.5}, Quatd::Identity(), scale);
        // A disc, an ellipse or a point at height 0.5: the disc of radius 1 and the ellipse meet the ball, the point is
        // 0.5 from it.
        const FreeformDistance d = pair.distance(pose, work, {.tolerance = 1e-5});
        EXPECT_NEAR(d.distance, scale.x() == 0 ? 0.5 : 0, 2e-5) << scale.transpose();
        pose.translation().z() = 3;
        const double truth = scale.z() == 0 ? 2 : 1;
        EXPECT_NEAR(pair.distance(pose, work, {.tolerance = 1e-5}).distance, truth, 2e-5) << scale.transpose();
        EXPECT_EQ(pair.touch(pose, 1e-4, work).touch, Touch::kNo);
    }
}

TEST(FreeformQueries, WorkThatIsExhaustedSaysSoAndStaysTrue) {
    // Spheres about one centre: everything is as near. The bounds hold whenever it stops.
    const FreeformShape a = sphere(1), b = sphere(0.7);
    FreeformPair pair(a, b);
    for (const std::uint64_t limit : {std::uint64_t{1}, std::uint64_t{100}, std::uint64_t{20'000}}) {
        QueryWork work{.limit = limit};
        const FreeformDistance d = pair.distance(Affine3d::Identity(), work, {.tolerance = 1e-12});
        EXPECT_FALSE(d.complete);
        EXPECT_LE(d.least, 0.3 + 1e-12);
        EXPECT_GE(d.distance, 0.3 - 1e-12);
        if (limit == 20'000) {
            EXPECT_GT(d.least, 0.29);
        }
    }
    QueryWork work{.limit = 1};
    EXPECT_EQ(pair.touch(Affine3d::Identity(), 1e-4, work).touch, Touch::kUnknown);
    QueryWork enough;
    EXPECT_EQ(pair.touch(Affine3d::Identity(), 1e-4, enough).touch, Touch::kNo);
}

TEST(FreeformQueries, BodiesWithoutExtentAreTheirPoint) {
    Chance chance(3);
    ControlMesh point = lumpyCube(chance, 2, 0.1);
    for (Vec3d& p : point.positions) p = Vec3d(3, 0, 0);
    ControlMesh flat = lumpyCube(chance, 2, 0.1);
    for (Vec3d& p : flat.positions) p = Vec3d(p.x(), p.y(), 0);
    const FreeformShape a = FreeformShape::ofSubdivision(point).value(), b = FreeformShape::ofSubdivision(flat).value(),
                        ball = sphere(1);
    FreeformPair withPoint(ball, a), withFlat(ball, b);
    QueryWork work;
    EXPECT_NEAR(withPoint.distance(Affine3d::Identity(), work, {.tolerance = 1e-6}).distance, 2, 2e-6);
    EXPECT_EQ(withPoint.touch(Affine3d::Identity(), 1e-4, work).touch, Touch::kNo);
    EXPECT_EQ(withPoint.touch(composeTransform({-2, 0, 0}, Quatd::Identity(), Vec3d::Ones()), 1e-4, work).touch,
              Touch::kYes);
    Affine3d above = Affine3d::Identity();
    above.translation().z() = 1.5;
    EXPECT_NEAR(withFlat.distance(above, work, {.tolerance = 1e-4}).distance, 0.5, 2e-4);
}

}  // namespace
}  // namespace tessera::test
