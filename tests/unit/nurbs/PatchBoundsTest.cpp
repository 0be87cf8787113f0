/// Bounds of patches beside dense samples. A failing seed: TESSERA_SEED=N build/bin/unit_nurbs.
#include "common/freeform/PatchBounds.h"

#include <gtest/gtest.h>

#include <algorithm>

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
            const Vec3d p = Vec3d(static_cast<double>(i) / patch.degreeU, static_cast<double>(j) / patch.degreeV, 0) +
                            wild * Vec3d(between(random, {-1, 1}), between(random, {-1, 1}), between(random, {-1, 1}));
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

TEST(PatchBounds, HoldEverywhereAndAreNotFarOff) {
    double tightest = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(1500); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const BezierPatch patch = somePatch(random);
        const Corners c = cornersOf(patch);
        const double bilinear = bilinearDeviation(patch);
        double off = 0;
        constexpr int kSteps = 16;
        for (int j = 0; j <= kSteps; ++j)
            for (int i = 0; i <= kSteps; ++i) {
                const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
                const Vec3d p = evaluate(patch, u, v).point;
                off = std::max(
                    off, (p - ((1 - v) * ((1 - u) * c.p00 + u * c.p10) + v * ((1 - u) * c.p01 + u * c.p11))).norm());
            }
        ASSERT_LE(off, bilinear + 1e-14) << "TESSERA_SEED=" << seed;
        tightest = std::max(tightest, off / (bilinear + 1e-300));
    }
    EXPECT_GT(tightest, std::getenv("TESSERA_SEED") ? 0 : 0.8);  // a bound that nothing comes near would be none
}

TEST(PatchBounds, ShrinkAsTheSquareOfThePatch) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(100); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        BezierPatch patch = somePatch(random);
        double before = 0;
        for (int level = 0; level < 12; ++level) {
            if (level == 8) before = bilinearDeviation(patch);
            for (const PatchAxis axis : {PatchAxis::kU, PatchAxis::kV}) patch = split(patch, axis)[random() % 2];
        }
        // Four halvings both ways: 1/256, when small enough for the square to rule; weights of 1e6 are not quite, after
        // eight.
        const double after = bilinearDeviation(patch);
        ASSERT_TRUE(after < before / 60 || after < 1e-13) << before << " " << after << " TESSERA_SEED=" << seed;
    }
}

}  // namespace
}  // namespace tessera
