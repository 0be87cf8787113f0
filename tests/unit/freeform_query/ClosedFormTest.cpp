// Spheres, planes, cubes: what distance and first contact are is known.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/Compose.h"
#include "tests/unit/freeform_query/SmoothBodies.h"
#include "tests/unit/nurbs/Plane.h"

namespace tessera::test {
namespace {

/// Rounding of places: 1e-12 of all coordinates involved.
double roundingOf(double scale, const Affine3d& map) {
    return 1e-12 * (4 * scale + map.translation().norm());
}

TEST(FreeformDistance, OfSpheresIsThatOfTheirCentresLessTheRadii) {
    for (const std::uint64_t seed : seedsOf(60)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const double scale = std::pow(10.0, chance.uniform(-8, 8)), ra = scale * chance.uniform(0.3, 1),
                     rb = ra * std::pow(10.0, chance.uniform(-3, 0));
        const FreeformShape a = sphere(ra), b = sphere(rb);
        FreeformPair pair(a, b);
        const double gap = scale * std::pow(10.0, chance.uniform(-7, 1));
        const bool nested = seed % 5 == 4;  // the small one within the large one, off its middle
        const double apart = nested ? std::max(0.3 * (ra - rb), ra - rb - gap) : ra + rb + gap;
        const double truth = nested ? ra - rb - apart : gap;
        const Affine3d pose = composeTransform(apart * chance.direction(), chance.rotation(), Vec3d::Ones());
        const double tolerance = 1e-6 * scale;
        QueryWork work;
        const FreeformDistance d = pair.distance(pose, work, {.tolerance = tolerance});
        ASSERT_TRUE(d.complete);
        EXPECT_LE(d.least, truth + roundingOf(scale, pose));
        EXPECT_GE(d.distance, truth - roundingOf(scale, pose));
        EXPECT_LE(d.distance - d.least, tolerance * (1 + 1e-9) + roundingOf(scale, pose));
        EXPECT_NEAR(d.a.point.norm(), ra, roundingOf(scale, pose));
        EXPECT_NEAR((d.b.point - pose.translation()).norm(), rb, roundingOf(scale, pose));
        EXPECT_NEAR((d.a.point - d.b.point).norm(), d.distance, roundingOf(scale, pose));
        EXPECT_LT((evaluate(a.nurbs()->surfaces[d.a.face], d.a.u, d.a.v).at.point - d.a.point).norm(),
                  roundingOf(scale, pose));
        EXPECT_LT((pose * evaluate(b.nurbs()->surfaces[d.b.face], d.b.u, d.b.v).at.point - d.b.point).norm(),
                  roundingOf(scale, pose));
        EXPECT_LT(work.boxTests, 400'000U);
    }
}

TEST(FreeformTouch, OfSpheresIsNeverMissedAndNeverBeyondTheTolerance) {
    for (const std::uint64_t seed : seedsOf(300)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const double scale = std::pow(10.0, chance.uniform(-8, 8)), ra = scale,
                     rb = scale * std::pow(10.0, chance.uniform(-2, 0));
        const FreeformShape a = sphere(ra), b = sphere(rb);
        FreeformPair pair(a, b);
        const double tolerance = scale * std::pow(10.0, chance.uniform(-6, -3));
        // Just touching, just apart, deep, within.
        const double off = std::pow(10.0, chance.uniform(-9, -1)) * scale;
        const bool touches = seed % 2 == 0;
        const double apart = touches ? std::max(ra + rb - std::min(off, rb), ra - rb) : ra + rb + tolerance + off;
        const Affine3d pose = composeTransform(apart * chance.direction(), chance.rotation(), Vec3d::Ones());
        QueryWork work;
        const FreeformTouch touch = pair.touch(pose, tolerance, work);
        ASSERT_NE(touch.touch, Touch::kUnknown);
        if (touches) {
            EXPECT_EQ(touch.touch, Touch::kYes) << "overlap " << ra + rb - apart << ", tolerance " << tolerance;
        } else {
            EXPECT_EQ(touch.touch, Touch::kNo) << "gap " << apart - ra - rb << ", tolerance " << tolerance;
        }
        if (touch.touch == Touch::kYes) {
            EXPECT_LE((touch.a.point - touch.b.point).norm(), tolerance * (1 + 1e-9) + roundingOf(scale, pose));
            EXPECT_NEAR(touch.a.point.norm(), ra, roundingOf(scale, pose));
            EXPECT_NEAR(touch.a.normal.dot(touch.a.point.normalized()), 1, 1e-6);
        }
    }
}

TEST(FreeformContacts, CoverTheCircleInWhichSpheresMeet) {
    for (const std::uint64_t seed : seedsOf(10)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const double ra = 1, rb = chance.uniform(0.4, 1);
        const FreeformShape a = sphere(ra), b = sphere(rb);
        FreeformPair pair(a, b);
        const double apart = chance.uniform(1.05 * std::abs(ra - rb) + 0.05, ra + rb - 0.05);
        const Vec3d direction = chance.direction();
        const Affine3d pose = composeTransform(apart * direction, chance.rotation(), Vec3d::Ones());
        const FreeformContactOptions options{.tolerance = 1e-6, .spacing = 0.05};
        QueryWork work;
        const FreeformContacts found = pair.contacts(pose, work, options);
        ASSERT_TRUE(found.complete);
        const double along = (apart * apart + ra * ra - rb * rb) / (2 * apart),
                     radius = std::sqrt(ra * ra - along * along);
        for (const FreeformContact& c : found.contacts) {
            EXPECT_LE((c.a.point - c.b.point).norm(), options.tolerance);
            EXPECT_NEAR(c.a.point.norm(), ra, 1e-12);
            EXPECT_NEAR(c.normal.norm(), 1, 1e-12);
            EXPECT_GT(c.normal.dot(direction), 0) << "from A to B";
        }
        const Vec3d u = direction.unitOrthogonal(), v = direction.cross(u);
        for (int i = 0; i < 90; ++i) {
            const double angle = i * 6.283185307179586 / 90;
            const Vec3d place = along * direction + radius * (std::cos(angle) * u + std::sin(angle) * v);
            double nearest = 1e9;
            for (const FreeformContact& c : found.contacts) nearest = std::min(nearest, (c.point - place).norm());
            EXPECT_LE(nearest, 4 * options.spacing) << i;
        }
        FreeformContactOptions few = options;
        few.most = 3;
        const FreeformContacts three = pair.contacts(pose, work, few);
        EXPECT_EQ(three.contacts.size(), 3U);
        EXPECT_FALSE(three.complete);
    }
}

TEST(FreeformImpact, OfSpheresIsNeverLateAndAtTheTolerance) {
    for (const std::uint64_t seed : seedsOf(120)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const double ra = chance.uniform(0.5, 1), rb = chance.uniform(0.05, 1),
                     tolerance = std::pow(10.0, chance.uniform(-6, -3));
        const FreeformShape a = sphere(ra), b = sphere(rb);
        FreeformPair pair(a, b);
        const Vec3d from = chance.uniform(ra + rb + 0.01, 4) * chance.direction(),
                    to = chance.uniform(0, 3) * chance.direction();
        BodyMotion still, moving;
        moving.start = {.translation = from, .rotation = chance.rotation()};
        moving.end = {.translation = to, .rotation = chance.rotation()};
        // |from + t (to - from)| = ra + rb, or their sum with the tolerance.
        const auto firstAt = [&](double reach) {
            const Vec3d way = to - from;
            const double aa = way.squaredNorm(), bb = from.dot(way), cc = from.squaredNorm() - reach * reach,
                         root = bb * bb - aa * cc;
            if (root < 0) return 2.0;
            const double t = (-bb - std::sqrt(root)) / aa;
            return t >= 0 && t <= 1 ? t : 2.0;
        };
        QueryWork work;
        const FreeformImpact hit = pair.firstContact(still, moving, tolerance, work);
        ASSERT_TRUE(hit.complete);
        const double touches = firstAt(ra + rb), near = firstAt(ra + rb + tolerance);
        if (touches <= 1) {
            ASSERT_TRUE(hit.hit);
            EXPECT_LE(hit.t, touches + 1e-10);
        }
        if (hit.hit) {
            EXPECT_GE(hit.t, near - 1e-9);
            EXPECT_LE(hit.distance, tolerance);
            EXPECT_LE((hit.a.point - hit.b.point).norm(), tolerance * (1 + 1e-9));
            EXPECT_GT(hit.normal.dot(moving.at(hit.t).translation), 0);
        } else {
            EXPECT_GT(touches, 1);
        }
    }
}

TEST(FreeformImpact, TouchingAtTheStartIsZero) {
    const FreeformShape a = sphere(1), b = sphere(1);
    FreeformPair pair(a, b);
    BodyMotion still, moving;
    moving.start.translation = {1.5, 0, 0};
    moving.end.translation = {5, 0, 0};
    QueryWork work;
    const FreeformImpact hit = pair.firstContact(still, moving, 1e-4, work);
    EXPECT_TRUE(hit.hit);
    EXPECT_EQ(hit.t, 0);
}

TEST(FreeformMeshes, CubeAndSphere) {
    std::vector<Vec3d> corners;
    for (int i = 0; i < 8; ++i)
        corners.emplace_back((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    const ConvexHull cube = ConvexHull::make(corners).value();
    const FreeformShape solid = FreeformShape::ofHull(cube).value(), ball = sphere(0.5);
    std::vector<double> positions;
    for (const Vec3d& p : cube.vertices()) positions.insert(positions.end(), {p.x(), p.y(), p.z()});
    std::vector<std::uint32_t> indices;
    for (const auto& f : cube.faces()) indices.insert(indices.end(), f.begin(), f.end());
    const FreeformShape shell =
        FreeformShape::ofTriangles(TriangleMesh::make(std::span<const double>(positions), indices).value()).value();
    FreeformPair withSolid(solid, ball), withShell(shell, ball), turned(ball, solid);
    for (const std::uint64_t seed : seedsOf(80)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const Vec3d at = chance.uniform(0, 3) * chance.direction();
        const Affine3d pose = composeTransform(at, chance.rotation(), Vec3d::Ones());
        const Vec3d outside = (at.cwiseAbs() - Vec3d::Ones()).cwiseMax(0);
        const double inside = (Vec3d::Ones() - at.cwiseAbs()).minCoeff();
        const double toShell = outside.norm() > 0 ? std::max(0.0, outside.norm() - 0.5) : std::max(0.0, inside - 0.5);
        const double toSolid = outside.norm() > 0 ? toShell : 0;
        QueryWork work;
        EXPECT_NEAR(withShell.distance(pose, work, {.tolerance = 1e-7}).distance, toShell, 1.1e-7);
        EXPECT_NEAR(withSolid.distance(pose, work, {.tolerance = 1e-7}).distance, toSolid, 1.1e-7);
        EXPECT_NEAR(turned.distance(pose.inverse(), work, {.tolerance = 1e-7}).distance, toSolid, 1.1e-7);
        if (std::abs(toSolid - 1e-4) > 1e-5) {
            EXPECT_EQ(withSolid.touch(pose, 1e-4, work).touch == Touch::kYes, toSolid < 1e-4);
            EXPECT_EQ(turned.touch(pose.inverse(), 1e-4, work).touch == Touch::kYes, toSolid < 1e-4);
        }
    }
}

TEST(FreeformTrims, AHoleLetsASphereThrough) {
    // A plate of 4 × 4 with a round hole of radius 1: a ball in its middle is as far from the edge as the radii differ.
    TrimLoop hole{.role = LoopRole::kHole, .curves = {circle({0, 0}, 1)}};
    const FreeformShape plate = FreeformShape::ofNurbs({planeSurface({{-2, 2}, {-2, 2}}, {hole}).value()}).value(),
                        ball = sphere(0.5);
    FreeformPair pair(plate, ball);
    for (const std::uint64_t seed : seedsOf(30)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const double away = chance.uniform(0, 1.9), angle = chance.uniform(0, 6.28), height = chance.uniform(-0.2, 0.2);
        const Vec3d at(away * std::cos(angle), away * std::sin(angle), height);
        const double toRing = away < 1 ? std::hypot(1 - away, height) : std::abs(height);
        const double truth = std::max(0.0, toRing - 0.5);
        const Affine3d pose = composeTransform(at, chance.rotation(), Vec3d::Ones());
        QueryWork work;
        const FreeformDistance d = pair.distance(pose, work, {.tolerance = 1e-3});
        EXPECT_TRUE(d.complete);
        EXPECT_LE(d.least, truth + 1e-9);
        EXPECT_NEAR(d.distance, truth, 1.1e-3);
        if (toRing > 0.51) {
            EXPECT_EQ(pair.touch(pose, 1e-3, work).touch, Touch::kNo);
        }
        if (toRing < 0.499) {
            EXPECT_EQ(pair.touch(pose, 1e-3, work).touch, Touch::kYes);
        }
    }
}

}  // namespace
}  // namespace tessera::test
