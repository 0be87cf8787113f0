#include "common/math/Compose.h"
#include "server/collision/spherical_bezier/SphericalBezierBound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "server/collision/spherical_bezier/SphericalBezierTouch.h"
#include "tests/unit/spherical_bezier/DeformingShapes.h"
#include "tests/unit/spherical_bezier/FacesOfPatches.h"

namespace tessera {
namespace {

using deforming::Random;
using deforming::seeds;
using deforming::Shape;

/// No point of any triangle is outside; each is on the list of the patch that it is in.
void expectHolds(const SphericalBezierBound& bound, Random& random, int points) {
    const TriangleMesh& mesh = bound.mesh();
    const Box& box = mesh.bounds();
    const double largest = std::max(
        {box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff(), bound.centre().cwiseAbs().maxCoeff()});
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face)
        for (int i = 0; i < 3 + points; ++i) {
            const Triangle t = mesh.triangle(face);
            const Vec3d x = (i < 3 ? t[static_cast<std::size_t>(i)] : deforming::pointOf(t, random)) - bound.centre();
            // Corners are what they are. Other points are made here, wrong by three products and two sums: 1e-15 of the
            // largest coordinate. So near the centre that turns them by more than the 1e-12 up to which lists overlap.
            if (i < 3 ? x.norm() == 0 : x.norm() < 2e-3 * largest) continue;
            ASSERT_LE(x.norm(), bound.outerRadius(x) * (1 + 1e-12)) << "face " << face;
            const PatchBound& patch = bound.patches()[bound.layout().locate(x).triangle];
            ASSERT_TRUE(std::binary_search(patch.faces.begin(), patch.faces.end(), face)) << "face " << face;
            ASSERT_LE((x - patch.ballCentre).norm(), patch.ballRadius * (1 + 1e-12)) << "face " << face;
        }
}

Vec3d someCentre(const Shape& shape, Random& random) {
    switch (random.below(5)) {
        case 0:
            return shape.positions[random.below(shape.positions.size())];  // on the surface
        case 1:
            return shape.positions[0] + random.inBox(5);  // outside, as a rule
        case 2:
            return shape.mesh().triangle(random.below(shape.indices.size() / 3))[0];
        default:
            return shape.mesh().bounds().center();
    }
}

TEST(SphericalBezierBound, HoldsEveryPointOfEveryTriangleAfterAnyDeformation) {
    for (const std::uint64_t seed : seeds(240)) {
        SCOPED_TRACE(deforming::repeat(seed, "SphericalBezierBound.HoldsEveryPointOfEveryTriangleAfterAnyDeformation"));
        Random random(seed);
        Shape shape = deforming::shape(static_cast<std::uint32_t>(seed % deforming::kKinds), random, 8);
        SphericalBezierBound bound(shape.mesh(), {.levels = random.below(4), .centre = someCentre(shape, random)});
        ASSERT_NO_FATAL_FAILURE(expectHolds(bound, random, 4));
        for (int step = 0; step < 5; ++step) {
            deforming::deform(random.below(deforming::kDeformations), shape.positions, random);
            ASSERT_TRUE(bound.move(shape.positions));
            ASSERT_NO_FATAL_FAILURE(expectHolds(bound, random, 4));
            if (random.below(4) == 0) bound.fit();
            ASSERT_NO_FATAL_FAILURE(expectHolds(bound, random, 2));
        }
    }
}

TEST(SphericalBezierBound, OfSomeVerticesIsThatOfAll) {
    for (const std::uint64_t seed : seeds(48)) {
        SCOPED_TRACE(deforming::repeat(seed, "SphericalBezierBound.OfSomeVerticesIsThatOfAll"));
        Random random(seed);
        Shape shape = deforming::shape(static_cast<std::uint32_t>(seed % deforming::kKinds), random, 8);
        SphericalBezierBound some(shape.mesh()), all(shape.mesh());
        for (int step = 0; step < 6; ++step) {
            const std::size_t first = random.below(shape.positions.size() + 1),
                              count = random.below(shape.positions.size() - first + 1);
            std::vector<Vec3d> moved(shape.positions.begin() + static_cast<std::ptrdiff_t>(first),
                                     shape.positions.begin() + static_cast<std::ptrdiff_t>(first + count));
            deforming::deform(random.below(deforming::kDeformations), moved, random);
            std::copy(moved.begin(), moved.end(), shape.positions.begin() + static_cast<std::ptrdiff_t>(first));
            ASSERT_TRUE(some.move(first, moved));
            ASSERT_TRUE(all.move(shape.positions));
            for (std::size_t p = 0; p < all.patches().size(); ++p) {
                ASSERT_EQ(some.patches()[p].faces, all.patches()[p].faces) << "patch " << p;
                if (all.patches()[p].faces.empty()) continue;
                ASSERT_EQ(some.patches()[p].form, all.patches()[p].form) << "patch " << p;
                ASSERT_EQ(some.patches()[p].upper, all.patches()[p].upper) << "patch " << p;
                ASSERT_EQ(some.patches()[p].ballRadius, all.patches()[p].ballRadius) << "patch " << p;
            }
        }
    }
}

TEST(SphericalBezierBound, IsTightOnABallAndContinuous) {
    Random random(3);
    const Shape ball = deforming::wrapped(96, 48, false, [](double u, double v) {
        const double s = std::numbers::pi * v, t = 2 * std::numbers::pi * u;
        return Vec3d(3 * std::sin(s) * std::cos(t), 3 * std::sin(s) * std::sin(t), 3 * std::cos(s));
    });
    const SphericalBezierBound bound(ball.mesh());
    for (int i = 0; i < 1000; ++i) EXPECT_LT(bound.outerRadius(random.direction()), 3.01);
    // Along every common edge both patches say the same.
    for (std::size_t t = 0; t < bound.patches().size(); ++t)
        for (std::size_t u = t + 1; u < bound.patches().size(); ++u) {
            std::vector<Vec3d> common;
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j)
                    if (bound.layout().points()[t][i] == bound.layout().points()[u][j])
                        common.push_back(bound.layout().triangles()[t].corner(i));
            if (common.size() != 2) continue;
            const double x = random.uniform();
            const Vec3d v = (x * common[0] + (1 - x) * common[1]).normalized();
            EXPECT_NEAR(v.dot(bound.patches()[t].form * v), v.dot(bound.patches()[u].form * v), 1e-10);
        }
}

TEST(SphericalBezierBound, RefusesWhatIsNoPositionAndStaysAsItWas) {
    Random random(4);
    Shape shape = deforming::shape(0, random, 8);
    SphericalBezierBound bound(shape.mesh());
    const double before = bound.outerRadius(Vec3d::UnitX());
    std::vector<Vec3d> bad = shape.positions;
    bad[7].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(bound.move(bad));
    EXPECT_FALSE(bound.move(3, std::span<const Vec3d>(bad).subspan(3, 10)));
    EXPECT_FALSE(bound.move(std::span<const Vec3d>(bad).subspan(1)));
    EXPECT_FALSE(bound.move(shape.positions.size(), std::span<const Vec3d>(shape.positions).first(1)));
    EXPECT_EQ(bound.outerRadius(Vec3d::UnitX()), before);
    const SphericalBezierBound nothing{TriangleMesh{}};
    EXPECT_EQ(nothing.outerRadius(Vec3d::UnitX()), 0);
}

Affine3d somePose(Random& random, double far) {
    const double scale = random.below(3) == 0 ? std::exp(random.uniform(-2, 2)) : 1;
    Affine3d pose =
        composeTransform(random.uniform(0, far) * random.direction(), random.rotation(), Vec3d::Constant(scale));
    if (random.below(5) == 0) pose.linear().col(0) *= -1;   // mirrored
    if (random.below(6) == 0) pose.linear().col(1) *= 0.3;  // no similarity
    if (random.below(20) == 0) pose.linear().setZero();     // all of B in one point
    return pose;
}

TEST(SphericalBezierTouch, NeverRejectsWhatMeets) {
    std::size_t touching = 0, rejected = 0;
    for (const std::uint64_t seed : seeds(600)) {
        SCOPED_TRACE(deforming::repeat(seed, "SphericalBezierTouch.NeverRejectsWhatMeets"));
        Random random(seed);
        Shape shapeA = deforming::shape(random.below(deforming::kKinds), random, 6),
              shapeB = deforming::shape(random.below(deforming::kKinds), random, 6);
        SphericalBezierBound a(shapeA.mesh(), {.levels = random.below(3)}),
            b(shapeB.mesh(), {.levels = random.below(3)});
        for (int k = 0; k < 2; ++k) {
            deforming::deform(random.below(deforming::kDeformations), shapeA.positions, random);
            deforming::deform(random.below(deforming::kDeformations), shapeB.positions, random);
        }
        ASSERT_TRUE(a.move(shapeA.positions));
        ASSERT_TRUE(b.move(shapeB.positions));
        const double far = 0.45 * (a.mesh().bounds().size().norm() + b.mesh().bounds().size().norm());
        Affine3d pose = somePose(random, far);
        pose.translation() += a.mesh().bounds().center() - pose.linear() * b.mesh().bounds().center();
        QueryWork work;
        std::vector<std::vector<bool>> left(a.mesh().faceCount(), std::vector<bool>(b.mesh().faceCount()));
        const std::vector<PatchPair> pairs = patchesThatMayMeet(a, b, pose, work);
        for (const PatchPair& p : pairs)
            for (const std::uint32_t f : a.patches()[p.a].faces)
                for (const std::uint32_t g : b.patches()[p.b].faces) left[f][g] = true;
        const std::vector<FacePair> truth = deforming::everyPair(a.mesh(), b.mesh(), pose);
        const bool any = !truth.empty();
        for (const FacePair& pair : truth) ASSERT_TRUE(left[pair.a][pair.b]) << "faces " << pair.a << ", " << pair.b;
        const TouchedPair found = patches::firstTouching(a, b, pose, work);
        ASSERT_EQ(found.touch, any ? Touch::kYes : Touch::kNo);
        if (any) {
            EXPECT_TRUE(trianglesIntersect(a.mesh().triangle(found.faces.a),
                                           transformed(pose, b.mesh().triangle(found.faces.b))));
        }
        touching += any;
        rejected += pairs.empty();
    }
    if (std::getenv("TESSERA_SEED") != nullptr) return;
    EXPECT_GT(touching, 50U);
    EXPECT_GT(rejected, 5U);
}

}  // namespace
}  // namespace tessera
