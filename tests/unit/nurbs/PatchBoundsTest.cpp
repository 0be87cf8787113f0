/// Bounds of patches beside dense samples. A failing seed: TESSERA_SEED=N build/bin/unit_nurbs.
#include "common/freeform/PatchBounds.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/freeform/nurbs/FlatPatches.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/unit/nurbs/NurbsOracle.h"

namespace tessera {
namespace {

/// Nearly flat ones, wild ones, and some with an edge in one point; weights of ratios up to 1e6.
BezierPatch somePatch(std::mt19937_64& random) {
    std::uniform_int_distribution<int> degree(1, 5);
    BezierPatch patch{.degreeU = degree(random), .degreeV = degree(random), .points = {}};
    const bool rational = random() % 2 == 0;
    const double wild = std::pow(10, between(random, {-6, 0.5})), ratio = random() % 4 == 0 ? 6 : 0.7;
    for (int j = 0; j <= patch.degreeV; ++j)
        for (int i = 0; i <= patch.degreeU; ++i) {
            const double w = rational ? std::pow(10, between(random, {-ratio / 2, ratio / 2})) : 1;
            const Vec3d p = Vec3d(static_cast<double>(i) / patch.degreeU, static_cast<double>(j) / patch.degreeV, 0) + wild * Vec3d(between(random, {-1, 1}), between(random, {-1, 1}), between(random, {-1, 1}));
            patch.points.emplace_back(w * p.x(), w * p.y(), w * p.z(), w);
        }
    if (random() % 6 == 0)
        for (int i = 1; i <= patch.degreeU; ++i) patch.at(i, 0) = patch.at(0, 0);
    return patch;
}
struct Corners {
    Vec3d p00, p10, p01, p11;
};
Corners cornersOf(const BezierPatch& p) {
    const auto at = [&](int i, int j) { return Vec3d(p.at(i, j).head<3>() / p.at(i, j).w()); };
    return {at(0, 0), at(p.degreeU, 0), at(0, p.degreeV), at(p.degreeU, p.degreeV)};
}

TEST(PatchBounds, OfFacetsHoldEverywhereAndAreNotFarOff) {
    double tightest = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(1500); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const BezierPatch patch = somePatch(random);
        const Corners c = cornersOf(patch);
        const double bilinear = bilinearDeviation(patch), facets = facetDeviation(patch);
        double offBilinear = 0, offFacets = 0;
        constexpr int kSteps = 16;
        for (int j = 0; j <= kSteps; ++j)
            for (int i = 0; i <= kSteps; ++i) {
                const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
                const Vec3d p = evaluate(patch, u, v).point;
                offBilinear = std::max(offBilinear, (p - ((1 - v) * ((1 - u) * c.p00 + u * c.p10) + v * ((1 - u) * c.p01 + u * c.p11))).norm());
                const Vec3d onFacet = u >= v ? Vec3d(c.p00 + u * (c.p10 - c.p00) + v * (c.p11 - c.p10)) : Vec3d(c.p00 + v * (c.p01 - c.p00) + u * (c.p11 - c.p01));
                offFacets = std::max(offFacets, (p - onFacet).norm());
            }
        ASSERT_LE(offBilinear, bilinear + 1e-14) << "TESSERA_SEED=" << seed;
        ASSERT_LE(offFacets, facets + 1e-14) << "TESSERA_SEED=" << seed;
        tightest = std::max(tightest, offFacets / (facets + 1e-300));
    }
    EXPECT_GT(tightest, std::getenv("TESSERA_SEED") ? 0 : 0.9);  // a bound that nothing comes near would be none
}

TEST(PatchBounds, OfFacetsShrinkAsTheSquareOfThePatch) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(100); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        BezierPatch patch = somePatch(random);
        double before = 0;
        for (int level = 0; level < 12; ++level) {
            if (level == 8) before = facetDeviation(patch);
            for (const PatchAxis axis : {PatchAxis::kU, PatchAxis::kV}) patch = split(patch, axis)[random() % 2];
        }
        // Four halvings both ways: 1/256, when small enough for the square to rule; weights of 1e6 are not quite, after eight.
        const double after = facetDeviation(patch);
        ASSERT_TRUE(after < before / 60 || after < 1e-13) << before << " " << after << " TESSERA_SEED=" << seed;
    }
}

TEST(PatchBounds, NormalConesHoldEveryNormal) {
    int cones = 0, narrow = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(3000); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        BezierPatch patch = somePatch(random);
        for (std::size_t k = 0, halvings = random() % 8; k < halvings; ++k) patch = split(patch, random() % 2 == 0 ? PatchAxis::kU : PatchAxis::kV)[random() % 2];
        const std::optional<NormalCone> cone = normalCone(patch);
        if (!cone) continue;
        ++cones;
        narrow += cone->halfAngle < 0.1;
        EXPECT_NEAR(cone->axis.norm(), 1, 1e-14);
        constexpr int kSteps = 12;
        for (int j = 0; j <= kSteps; ++j)
            for (int i = 0; i <= kSteps; ++i) {
                const SurfacePoint p = evaluate(patch, static_cast<double>(i) / kSteps, static_cast<double>(j) / kSteps);
                const Vec3d across = p.du.cross(p.dv);
                // Derivatives are rounded as coordinates are.
                const double rounding = 1e-14 * (p.du.norm() + p.dv.norm()) / std::max(across.norm(), 1e-300);
                if (rounding > 0.1) continue;
                const double angle = std::atan2(across.cross(cone->axis).norm(), across.dot(cone->axis));
                ASSERT_LE(angle, cone->halfAngle + rounding + 1e-14) << i << " " << j << " TESSERA_SEED=" << seed;
            }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(cones, 1000);
        EXPECT_GT(narrow, 300);
    }
}

TEST(PatchBounds, NormalConesOfASphereAreItsAngles) {
    // A 64th of a turn and of a half turn: half of it both ways, and what steps of control points add.
    for (const ParameterPatch& octant : bezierPatches(*sphereSurface(3))) {
        BezierPatch patch = octant.patch;
        for (int k = 0; k < 4; ++k)
            for (const PatchAxis axis : {PatchAxis::kU, PatchAxis::kV}) patch = split(patch, axis)[1];
        const std::optional<NormalCone> cone = normalCone(patch);
        ASSERT_TRUE(cone);  // poles too
        EXPECT_LT(cone->halfAngle, 0.15);
        EXPECT_GT(cone->halfAngle, 0.04);
    }
}

TEST(PatchBounds, ThereIsNoConeOfWhatTurnsTooFarOrIsNoSurface) {
    const auto bent = [](double height) {
        BezierPatch p{.degreeU = 2, .degreeV = 1, .points = {}};
        for (const double y : {0.0, 1.0})
            for (int i = 0; i < 3; ++i) p.points.emplace_back(i == 1 ? 0.5 : 0, y, i * height, 1);
        return p;
    };
    EXPECT_FALSE(normalCone(bent(0)));  // there and back
    EXPECT_TRUE(normalCone(bent(1)));
    EXPECT_FALSE(normalCone({.degreeU = 1, .degreeV = 1, .points = std::vector<Vec4d>(4, {1, 2, 3, 1})}));
    BezierPatch line{.degreeU = 1, .degreeV = 1, .points = {{0, 0, 0, 1}, {1, 1, 1, 1}, {2, 2, 2, 1}, {3, 3, 3, 1}}};
    EXPECT_FALSE(normalCone(line));
}

TEST(FlatPatches, CoverTheKeptPartWithinTheTolerance) {
    for (const double tolerance : {0.1, 0.003}) {
        const Expected<NurbsSurface> sphere = sphereSurface(1, {{LoopRole::kHole, {circle({1.3, 1.1}, 0.4)}}});
        ASSERT_TRUE(sphere);
        const Expected<std::vector<FlatPatch>> flat = flatPatches(*sphere, tolerance);
        ASSERT_TRUE(flat) << flat.error().message;
        int crossed = 0;
        for (const FlatPatch& f : *flat) {
            EXPECT_LE(f.deviation, tolerance);
            EXPECT_NE(f.side, RectangleSide::kTrimmedAway);
            crossed += f.side == RectangleSide::kCrossed;
            // It is the surface over its rectangle, and that near to its corners' plane.
            const double u = f.over.u.lower + 0.3 * f.over.u.size(), v = f.over.v.lower + 0.6 * f.over.v.size();
            EXPECT_LT((evaluate(f.patch, 0.3, 0.6).point - evaluate(*sphere, u, v).at.point).norm(), 1e-13);
        }
        EXPECT_GT(crossed, 4);
        EXPECT_LT(flat->size(), 8 * 4 / tolerance);  // a sphere of so many facets is off by about that
        std::mt19937_64 random(7);
        for (int k = 0; k < 2000; ++k) {
            const Vec2d p(between(random, {0, 4}), between(random, {0, 2}));
            if (sphere->region().side(p) != TrimSide::kKept) continue;
            EXPECT_TRUE(std::any_of(flat->begin(), flat->end(), [&](const FlatPatch& f) {
                return p.x() >= f.over.u.lower && p.x() <= f.over.u.upper && p.y() >= f.over.v.lower && p.y() <= f.over.v.upper;
            }));
        }
    }
}

TEST(FlatPatches, AreRefusedBeyondTheirLimits) {
    const NurbsSurface sphere = *sphereSurface(1);
    EXPECT_EQ(flatPatches(sphere, 0).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(flatPatches(sphere, std::nan("")).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(flatPatches(sphere, 1e-9, {.maxPatches = 1000}).error().code, ErrorCode::kLimit);
    EXPECT_EQ(flatPatches(sphere, 1e-300, {.maxPatches = 1000}).error().code, ErrorCode::kLimit);
    EXPECT_EQ(flatPatches(sphere, 10)->size(), 8u);
}

}  // namespace
}  // namespace tessera
