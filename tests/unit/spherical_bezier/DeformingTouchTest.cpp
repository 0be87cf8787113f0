#include "common/math/Compose.h"
#include "server/collision/spherical_bezier/DeformingTouch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "server/collision/spherical_bezier/DeformingStorage.h"
#include "tests/support/words/Words.h"
#include "tests/unit/spherical_bezier/DeformingShapes.h"

namespace tessera {
namespace {

using deforming::Random;
using deforming::seeds;
using deforming::Shape;

Affine3d anyPose(const Box& a, const Box& b, Random& random) {
    const double scale = random.below(3) == 0 ? std::exp(random.uniform(-3, 3)) : 1;
    Affine3d pose = composeTransform(Vec3d::Zero(), random.rotation(), Vec3d::Constant(scale));
    if (random.below(5) == 0) pose.linear().col(0) *= -1;
    if (random.below(4) == 0) pose.linear().col(1) *= 0.3;
    if (random.below(15) == 0) pose.linear().col(2).setZero();
    if (random.below(8) == 0) pose.linear().setIdentity();
    const double reach = 0.6 * (a.size().norm() + (pose.linear() * b.size()).norm());
    pose.translation() = a.center() - pose.linear() * b.center() + random.uniform(0, reach) * random.direction();
    return pose;
}

TEST(DeformingTouch, NamesThePairsThatThePredicateNames) {
    DeformingTouch touch;
    std::size_t touching = 0, apart = 0;
    for (const std::uint64_t seed : seeds(300)) {
        SCOPED_TRACE(deforming::repeat(seed, "DeformingTouch.NamesThePairsThatThePredicateNames"));
        Random random(seed);
        // Whole scenes of other units, and far from the origin.
        const double unit = std::array{1.0, 1.0, 1e-30, 1e30}[random.below(4)];
        const Vec3d far = random.below(4) == 0 ? Vec3d(unit * 1e6 * random.direction()) : Vec3d::Zero();
        const auto inUnits = [&](const Shape& shape) {
            Shape out = shape;
            for (Vec3d& p : out.positions) p = unit * p + far;
            return out;
        };
        Shape shapeA = deforming::shape(random.below(deforming::kKinds), random, 7),
              shapeB = deforming::shape(random.below(deforming::kKinds), random, 7);
        DeformingSurface a(inUnits(shapeA).mesh()), b(inUnits(shapeB).mesh());
        for (int step = 0; step < 2; ++step) {
            const TriangleMesh meshA = inUnits(shapeA).mesh(), meshB = inUnits(shapeB).mesh();
            const Affine3d pose = anyPose(meshA.bounds(), meshB.bounds(), random);
            const std::vector<FacePair> truth = deforming::everyPair(meshA, meshB, pose);
            QueryWork work;
            const FacePairs all = touch.all(a, b, pose, work);
            ASSERT_TRUE(all.complete);
            ASSERT_EQ(all.pairs, truth);
            const TouchedPair first = touch.first(a, b, pose, work);
            ASSERT_EQ(first.touch, truth.empty() ? Touch::kNo : Touch::kYes);
            if (!truth.empty()) {
                ASSERT_TRUE(std::binary_search(truth.begin(), truth.end(), first.faces));
            }
            (truth.empty() ? apart : touching) += 1;
            deforming::deform(random.below(deforming::kDeformations), shapeA.positions, random);
            deforming::deform(random.below(deforming::kDeformations), shapeB.positions, random);
            ASSERT_TRUE(a.move(inUnits(shapeA).positions));
            ASSERT_TRUE(b.move(inUnits(shapeB).positions));
        }
    }
    if (std::getenv("TESSERA_SEED") != nullptr) return;
    EXPECT_GT(touching, 100U);
    EXPECT_GT(apart, 50U);
}

TEST(DeformingSurface, OfSomeVerticesAnswersAsOfAll) {
    DeformingTouch touch;
    for (const std::uint64_t seed : seeds(120)) {
        SCOPED_TRACE(deforming::repeat(seed, "DeformingSurface.OfSomeVerticesAnswersAsOfAll"));
        Random random(seed);
        Shape shape = deforming::shape(static_cast<std::uint32_t>(seed % deforming::kKinds), random, 20);
        const Shape other = deforming::shape(0, random, 10);
        DeformingSurface some(shape.mesh());
        const DeformingSurface b(other.mesh());
        for (int step = 0; step < 4; ++step) {
            const std::size_t first = random.below(shape.positions.size() + 1);
            const std::size_t most =
                std::min<std::size_t>(shape.positions.size() - first, step % 2 == 0 ? 40 : 100'000);
            std::vector<Vec3d> moved(
                shape.positions.begin() + static_cast<std::ptrdiff_t>(first),
                shape.positions.begin() + static_cast<std::ptrdiff_t>(first + random.below(most + 1)));
            deforming::deform(random.below(deforming::kDeformations), moved, random);
            std::copy(moved.begin(), moved.end(), shape.positions.begin() + static_cast<std::ptrdiff_t>(first));
            ASSERT_TRUE(some.move(first, moved));
            const TriangleMesh mesh = shape.mesh();
            const Box bounds = some.bounds();
            ASSERT_TRUE((bounds.lower.array() <= mesh.bounds().lower.array()).all() &&
                        (bounds.upper.array() >= mesh.bounds().upper.array()).all());
            ASSERT_LT((bounds.size() - mesh.bounds().size()).maxCoeff(), 1e-4 * mesh.bounds().size().norm() + 1e-12);
            const DeformingSurface all(mesh);
            const Affine3d pose = anyPose(mesh.bounds(), other.mesh().bounds(), random);
            QueryWork work;
            ASSERT_EQ(touch.all(some, b, pose, work).pairs, touch.all(all, b, pose, work).pairs);
        }
    }
}

TEST(DeformingSurface, MovedInPartCostsItsGroupsAlone) {
    Random random(1);
    Shape shape = deforming::shape(0, random, 60);
    DeformingSurface surface(shape.mesh());
    const std::vector<float> before = [&] {
        const lanes::BoxRows rows = surface.storage().boxes.rows();
        return std::vector<float>(rows.sides, rows.sides + 6 * rows.stride);
    }();
    shape.positions[500] *= 1.5;
    ASSERT_TRUE(surface.move(500, std::span<const Vec3d>(shape.positions).subspan(500, 1)));
    const lanes::BoxRows rows = surface.storage().boxes.rows();
    std::size_t changed = 0;
    for (std::size_t g = 0; g < surface.storage().groupCount(); ++g) {
        bool same = true;
        for (std::size_t k = 0; k < 6; ++k)
            same = same && rows.sides[k * rows.stride + g] == before[k * rows.stride + g];
        changed += same ? 0 : 1;
    }
    EXPECT_GE(changed, 1U);
    EXPECT_LE(changed, 6U);
}

TEST(DeformingSurface, RefusesWhatIsNoPositionAndStaysAsItWas) {
    Random random(2);
    Shape shape = deforming::shape(0, random);
    DeformingSurface surface(shape.mesh());
    const Box before = surface.bounds();
    for (const double wrong :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e51}) {
        std::vector<Vec3d> bad = shape.positions;
        bad[5].z() = wrong;
        const Expected<void> moved = surface.move(bad);
        ASSERT_FALSE(moved);
        EXPECT_WORDS(moved.error().message);
        const Expected<void> part = surface.move(4, std::span<const Vec3d>(bad).subspan(4, 3));
        ASSERT_FALSE(part);
        EXPECT_WORDS(part.error().message);
    }
    EXPECT_FALSE(surface.move(std::span<const Vec3d>(shape.positions).subspan(1)));
    EXPECT_FALSE(surface.move(shape.positions.size(), std::span<const Vec3d>(shape.positions).first(1)));
    EXPECT_FALSE(
        surface.move(std::numeric_limits<std::size_t>::max(), std::span<const Vec3d>(shape.positions).first(1)));
    EXPECT_EQ(surface.bounds().lower, before.lower);
    EXPECT_EQ(surface.bounds().upper, before.upper);
}

TEST(DeformingTouch, OfNothingMeetsNothing) {
    Random random(3);
    DeformingTouch touch;
    const DeformingSurface nothing{TriangleMesh{}}, ball(deforming::shape(0, random).mesh());
    QueryWork work;
    EXPECT_EQ(touch.first(nothing, ball, Affine3d::Identity(), work).touch, Touch::kNo);
    EXPECT_EQ(touch.first(ball, nothing, Affine3d::Identity(), work).touch, Touch::kNo);
    EXPECT_TRUE(touch.all(nothing, nothing, Affine3d::Identity(), work).pairs.empty());
    EXPECT_TRUE(nothing.bounds().empty());
}

TEST(DeformingTouch, SaysWhenItsWorkIsSpent) {
    Random random(4);
    DeformingTouch touch;
    const DeformingSurface a(deforming::shape(0, random, 60).mesh()), b(deforming::shape(0, random, 60).mesh());
    const Affine3d aside(Eigen::Translation3d(1.3, 0.2, 0.4));
    QueryWork little{.limit = 1};
    EXPECT_EQ(touch.first(a, b, aside, little).touch, Touch::kUnknown);
    QueryWork some{.limit = 300};
    EXPECT_FALSE(touch.all(a, b, aside, some).complete);
    QueryWork enough;
    EXPECT_EQ(touch.first(a, b, aside, enough).touch, Touch::kYes);
    // All against all would be 200 million.
    EXPECT_LT(enough.boxTests + enough.triangleTests, 20'000U);
}

TEST(DeformingTouch, TakesMapsThatNoFloatHolds) {
    Random random(5);
    DeformingTouch touch;
    const Shape shape = deforming::shape(3, random);
    const DeformingSurface a(shape.mesh());
    for (const double scale : {1e-45, 1e20, 1e45}) {
        const Affine3d huge(Eigen::Scaling(scale));
        Shape other = shape;
        for (Vec3d& p : other.positions) p /= scale;
        if (other.positions[0].cwiseAbs().maxCoeff() > 1e49) continue;
        const DeformingSurface b(other.mesh());
        QueryWork work;
        EXPECT_EQ(touch.all(a, b, huge, work).pairs, deforming::everyPair(shape.mesh(), other.mesh(), huge));
    }
    // Of the same coordinates, so that one is a point beside the other.
    for (const double scale : {1e-45, 1e20, 1e45}) {
        QueryWork work;
        EXPECT_EQ(touch.all(a, a, Affine3d(Eigen::Scaling(scale)), work).pairs,
                  deforming::everyPair(shape.mesh(), shape.mesh(), Affine3d(Eigen::Scaling(scale))));
    }
}

}  // namespace
}  // namespace tessera
