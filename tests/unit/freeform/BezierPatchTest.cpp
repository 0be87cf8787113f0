/// Patches beside the Bernstein sum. A failing seed: TESSERA_SEED=N build/bin/unit_freeform.
#include "common/freeform/BezierPatch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

namespace tessera {
namespace {

using Wide = Eigen::Matrix<long double, 4, 1>;

long double bernstein(int degree, int i, long double t) {
    long double value = 1;
    for (int k = 1; k <= i; ++k) value *= static_cast<long double>(degree - i + k) / k;
    return value * std::pow(t, static_cast<long double>(i)) * std::pow(1 - t, static_cast<long double>(degree - i));
}
Vec3d bySum(const BezierPatch& patch, double u, double v) {
    Wide sum = Wide::Zero();
    for (int j = 0; j <= patch.degreeV; ++j)
        for (int i = 0; i <= patch.degreeU; ++i)
            sum += bernstein(patch.degreeU, i, u) * bernstein(patch.degreeV, j, v) * patch.at(i, j).cast<long double>();
    return (sum.head<3>() / sum.w()).cast<double>();
}

BezierPatch somePatch(std::mt19937_64& random) {
    std::uniform_real_distribution<double> some(-1, 1), weight(0.2, 3);
    std::uniform_int_distribution<int> degree(1, 7);
    BezierPatch patch{.degreeU = degree(random), .degreeV = degree(random), .points = {}};
    const bool rational = random() % 2 == 0;
    for (int k = 0; k < (patch.degreeU + 1) * (patch.degreeV + 1); ++k) {
        const double w = rational ? weight(random) : 1;
        patch.points.emplace_back(w * some(random), w * some(random), w * some(random), w);
    }
    return patch;
}
std::uint64_t seedOr(std::uint64_t usual) {
    const char* const given = std::getenv("TESSERA_SEED");
    return given ? std::strtoull(given, nullptr, 10) : usual;
}

TEST(BezierPatches, AreTheBernsteinSum) {
    const std::uint64_t first = seedOr(1);
    for (std::uint64_t seed = first; seed < first + 300; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> inside(0, 1);
        const BezierPatch patch = somePatch(random);
        for (int k = 0; k < 20; ++k) {
            const double u = k == 0 ? 0 : k == 1 ? 1 : inside(random), v = k == 2 ? 0 : k == 1 ? 1 : inside(random);
            const SurfacePoint p = evaluate(patch, u, v);
            ASSERT_LT((p.point - bySum(patch, u, v)).norm(), 1e-13) << "TESSERA_SEED=" << seed;
            EXPECT_EQ(p.error, 0);
            constexpr double h = 1e-5;
            if (u < h || u > 1 - h || v < h || v > 1 - h) continue;
            ASSERT_LT((p.du - (bySum(patch, u + h, v) - bySum(patch, u - h, v)) / (2 * h)).norm(),
                      1e-5 * (1 + p.du.norm()))
                << "TESSERA_SEED=" << seed;
            ASSERT_LT((p.dv - (bySum(patch, u, v + h) - bySum(patch, u, v - h)) / (2 * h)).norm(),
                      1e-5 * (1 + p.dv.norm()))
                << "TESSERA_SEED=" << seed;
            ASSERT_LT(std::abs(p.normal.dot(p.du)), 1e-9 * p.du.norm());
        }
    }
}

TEST(BezierPatches, PartsAreTheWholeAndLieInTheirBoxes) {
    const std::uint64_t first = seedOr(1);
    for (std::uint64_t seed = first; seed < first + 200; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> inside(0.05, 0.95);
        const BezierPatch patch = somePatch(random);
        const double t = seed % 3 == 0 ? 0.5 : inside(random);
        for (const PatchAxis axis : {PatchAxis::kU, PatchAxis::kV}) {
            const auto parts = split(patch, axis, t);
            for (int k = 0; k < 20; ++k) {
                const double u = inside(random), v = inside(random);
                for (const bool above : {false, true}) {
                    const auto whole = [&](double s) { return above ? t + s * (1 - t) : s * t; };
                    const BezierPatch& part = parts[above ? 1 : 0];
                    const Vec3d p = evaluate(part, u, v).point;
                    const Vec3d q = axis == PatchAxis::kU ? bySum(patch, whole(u), v) : bySum(patch, u, whole(v));
                    ASSERT_LT((p - q).norm(), 1e-12) << "TESSERA_SEED=" << seed;
                    Box box = boxOf(part);
                    box.lower.array() -= 1e-14;
                    box.upper.array() += 1e-14;
                    EXPECT_TRUE(box.contains(p)) << "TESSERA_SEED=" << seed;
                }
            }
        }
    }
}

TEST(BezierPatches, APoleHasTheNormalThatItsNeighboursTendTo) {
    // An octant of the unit sphere: a quarter circle of weights 1, 1/√2, 1, turned about y; v = 1 is the pole.
    const double r = std::sqrt(0.5);
    BezierPatch octant{.degreeU = 2, .degreeV = 2, .points = std::vector<Vec4d>(9)};
    const Vec4d circle[3] = {{1, 0, 0, 1}, {r, 0, r, r}, {0, 0, 1, 1}};
    const Vec3d arc[3] = {{1, 0, 1}, {r, r, r}, {0, 1, 1}};  // along the circle, up, weight
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
            octant.at(i, j) = {circle[i].x() * arc[j].x(), circle[i].w() * arc[j].y(), circle[i].z() * arc[j].x(),
                               circle[i].w() * arc[j].z()};
    for (const double u : {0.0, 0.3, 0.5, 1.0}) {
        for (const double v : {0.0, 0.4, 0.9, 1.0}) {
            const SurfacePoint p = evaluate(octant, u, v);
            EXPECT_NEAR(p.point.norm(), 1, 1e-14);
            EXPECT_NEAR(std::abs(p.normal.dot(p.point)), 1, v == 1 ? 1e-7 : 1e-12) << u << " " << v;
            EXPECT_NEAR(p.normal.norm(), 1, 1e-12);
        }
    }
    // All points in one: no normal, and no number that is none.
    const SurfacePoint nothing =
        evaluate({.degreeU = 1, .degreeV = 1, .points = std::vector<Vec4d>(4, {1, 2, 3, 1})}, 0.5, 0.5);
    EXPECT_EQ(nothing.point, Vec3d(1, 2, 3));
    EXPECT_EQ(nothing.normal, Vec3d(0, 0, 0));
}

}  // namespace
}  // namespace tessera
