/// Nearest points beside closed forms and dense samples. A failing seed: TESSERA_SEED=N build/bin/unit_nurbs.
#include "common/freeform/PatchDistance.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/freeform/nurbs/NurbsDistance.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/unit/nurbs/NurbsOracle.h"
#include "tests/unit/nurbs/Plane.h"

namespace tessera {
namespace {

Vec3d somePlace(std::mt19937_64& random, double reach) {
    return {between(random, {-reach, reach}), between(random, {-reach, reach}), between(random, {-reach, reach})};
}

TEST(PatchDistances, AreThoseOfSpheresAndTori) {
    const NurbsDistance sphere(*sphereSurface(1)), torus(*torusSurface(1, 0.3));
    std::mt19937_64 random(1);
    for (int k = 0; k < 300; ++k) {
        Vec3d p = somePlace(random, 2);
        if (k % 10 == 0) p.x() = p.z() = 0;  // on the axis, below a pole
        if (k % 10 == 1) p.normalize();
        const std::optional<ClosestPoint> onSphere = sphere.closestPoint(p, 1e-10),
                                          onTorus = torus.closestPoint(p, 1e-10);
        ASSERT_TRUE(onSphere && onTorus);
        EXPECT_NEAR(onSphere->distance, std::abs(p.norm() - 1), 1e-10 + 1e-14) << p.transpose();
        EXPECT_LE(onSphere->error, 1e-10) << p.transpose();
        const double ring = std::abs(std::hypot(std::hypot(p.x(), p.z()) - 1, p.y()) - 0.3);
        // On its axis a whole circle of the torus is as near: that may take more parts than there are to look at, and
        // says so.
        EXPECT_NEAR(onTorus->distance, ring, std::max(onTorus->error, 1e-10) + 1e-14) << p.transpose();
        if (k % 10 != 0) {
            EXPECT_LE(onTorus->error, 1e-10) << p.transpose();
        }
        EXPECT_NEAR((evaluate(*torusSurface(1, 0.3), onTorus->u, onTorus->v).at.point - onTorus->point).norm(), 0,
                    1e-13);
    }
}

TEST(PatchDistances, SayHowWrongTheyMayBeWhereAllIsAsNear) {
    const NurbsDistance sphere(*sphereSurface(1));
    const std::optional<ClosestPoint> center = sphere.closestPoint(Vec3d::Zero(), 1e-12, 3000);
    ASSERT_TRUE(center);
    EXPECT_NEAR(center->distance, 1, 1e-15);
    EXPECT_GT(center->error, 1e-12);
    EXPECT_LT(center->error, 0.01);
}

TEST(PatchDistances, AreNeverAboveDenseSamplesNorBelowByMoreThanTheySay) {
    int edges = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(150); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const NurbsDefinition d = someSurface(random, 4);
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        if (!surface) continue;
        const NurbsDistance distance(*surface);
        std::vector<Vec3d> samples;
        for (const ParameterPatch& p : bezierPatches(*surface))
            for (int j = 0; j <= 12; ++j)
                for (int i = 0; i <= 12; ++i) samples.push_back(evaluate(p.patch, i / 12.0, j / 12.0).point);
        for (int k = 0; k < 8; ++k) {
            const Vec3d place = somePlace(random, k == 0 ? 100 : 1.5);
            const std::optional<ClosestPoint> closest = distance.closestPoint(place, 1e-9);
            ASSERT_TRUE(closest) << "TESSERA_SEED=" << seed;
            EXPECT_LE(closest->error, 1e-9) << "TESSERA_SEED=" << seed;
            EXPECT_NEAR((closest->point - place).norm(), closest->distance, 1e-12);
            for (const Vec3d& s : samples)
                ASSERT_GE((s - place).norm(), closest->distance - closest->error - 1e-12) << "TESSERA_SEED=" << seed;
            // And it is a point of the surface; on a knot one of two, where the surface jumps.
            const SurfacePoint there = evaluate(*surface, closest->u, closest->v).at;
            const bool onKnot = std::count(d.u.knots.begin(), d.u.knots.end(), closest->u) +
                                    std::count(d.v.knots.begin(), d.v.knots.end(), closest->v) >
                                0;
            edges += onKnot;
            ASSERT_TRUE(onKnot || (there.point - closest->point).norm() < 1e-9) << "TESSERA_SEED=" << seed;
        }
    }
    EXPECT_GT(edges, std::getenv("TESSERA_SEED") ? -1 : 100);
}

TEST(PatchDistances, OfTrimmedSurfacesAreToWhatIsLeft) {
    // A disc without its middle in the plane: distances in closed form.
    const double outer = 1.5, inner = 0.5;
    const NurbsDistance ring(*planeSurface(
        {{-2, 2}, {-2, 2}}, {{LoopRole::kOuter, {circle({0, 0}, outer)}}, {LoopRole::kHole, {circle({0, 0}, inner)}}}));
    std::mt19937_64 random(5);
    for (int k = 0; k < 25; ++k) {
        const Vec3d p = somePlace(random, 2.5);
        const double r = std::hypot(p.x(), p.y()), truth = std::hypot(p.z(), r - std::clamp(r, inner, outer));
        const std::optional<ClosestPoint> closest = ring.closestPoint(p, 1e-6);
        ASSERT_TRUE(closest);
        EXPECT_LE(closest->error, 1e-6) << p.transpose();
        EXPECT_NEAR(closest->distance, truth, 1e-6 + 1e-11) << p.transpose();
    }
    // At the domain's own edge, wherever its numbers round to.
    for (const double upper : {0.7, 0.3, 1.1, 1.9}) {
        const NurbsDistance edge(
            *planeSurface({{0.1, upper}, {0.1, upper}}, {{LoopRole::kHole, {circle({0.15, 0.15}, 0.01)}}}));
        const std::optional<ClosestPoint> closest = edge.closestPoint(Vec3d(3, 3, 1), 1e-12);
        ASSERT_TRUE(closest);
        EXPECT_EQ(closest->u, upper);
        EXPECT_EQ(closest->v, upper);
        EXPECT_LE(closest->error, 1e-12);
    }
    const NurbsDistance nothing(*planeSurface({{0, 1}, {0, 1}}, {{LoopRole::kOuter, {circle({5, 5}, 1)}}}));
    EXPECT_FALSE(nothing.closestPoint(Vec3d::Zero(), 1e-6));
}

TEST(PatchDistances, AreNoneOfNothing) {
    EXPECT_FALSE(closestPoint({}, Vec3d::Zero()));
    const BezierPatch point{.degreeU = 1, .degreeV = 1, .points = std::vector<Vec4d>(4, {1, 2, 2, 1})};
    EXPECT_FALSE(closestPoint(std::span(&point, 1), Vec3d(std::nan(""), 0, 0)));
    const std::optional<ClosestPoint> closest = closestPoint(std::span(&point, 1), Vec3d::Zero());
    ASSERT_TRUE(closest);
    EXPECT_EQ(closest->distance, 3);
    EXPECT_EQ(closest->error, 0);
}

}  // namespace
}  // namespace tessera
