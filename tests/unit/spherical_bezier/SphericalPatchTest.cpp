#include "server/collision/spherical_bezier/SphericalPatch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/collision/spherical_bezier/SphereLayout.h"
#include "tests/unit/spherical_bezier/DeformingShapes.h"

namespace tessera {
namespace {

using deforming::Random;
using deforming::seeds;

SphericalTriangle randomDomain(Random& random) {
    for (;;) {
        const Expected<SphericalTriangle> t =
            SphericalTriangle::make({random.direction(), random.direction(), random.direction()});
        if (t && t->height() > 0.1) return *t;
    }
}
/// A direction inside, or on an edge.
Vec3d inside(const SphericalTriangle& t, Random& random) {
    const double a = random.uniform(), b = random.below(3) == 0 ? 0 : random.uniform(), c = random.uniform();
    return (a * t.corner(0) + b * t.corner(1) + (c + 1e-9) * t.corner(2)).normalized();
}
SphericalPatch randomPatch(unsigned degree, Random& random) {
    std::vector<double> c(SphericalPatch::coefficientCount(degree));
    for (double& x : c) x = random.uniform(-1, 2);
    return SphericalPatch::make(randomDomain(random), degree, c).value();
}
/// The sum of the definition, term by term.
double bySum(const SphericalPatch& p, const Vec3d& v) {
    const Vec3d b = p.domain().coordinates(v);
    double sum = 0;
    const auto factorial = [](unsigned n) { return std::tgamma(n + 1.0); };
    for (unsigned i = 0; i <= p.degree(); ++i)
        for (unsigned j = 0; i + j <= p.degree(); ++j) {
            const unsigned k = p.degree() - i - j;
            sum += p.coefficients()[SphericalPatch::place(p.degree(), i, j)] * factorial(p.degree()) / factorial(i) /
                   factorial(j) / factorial(k) * std::pow(b[0], i) * std::pow(b[1], j) * std::pow(b[2], k);
        }
    return sum;
}

TEST(SphericalTriangle, CoordinatesSumToBetweenOneAndOneOverTheHeight) {
    Random random(1);
    const SphericalTriangle octant = SphericalTriangle::make({Vec3d::UnitX(), Vec3d::UnitY(), Vec3d::UnitZ()}).value();
    EXPECT_NEAR(1 / octant.height(), std::sqrt(3.0), 1e-12);
    for (int i = 0; i < 3000; ++i) {
        const SphericalTriangle t = i % 10 == 0 ? octant : randomDomain(random);
        const Vec3d v = inside(t, random), b = t.coordinates(v);
        EXPECT_LT((b[0] * t.corner(0) + b[1] * t.corner(1) + b[2] * t.corner(2) - v).norm(), 1e-12);
        EXPECT_GE(b.minCoeff(), -1e-12);
        EXPECT_GE(b.sum(), 1 - 1e-12);
        EXPECT_LE(b.sum(), (1 + 1e-12) / t.height());
        EXPECT_NEAR(b.sum(), t.axis().dot(v) / t.height(), 1e-11);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(t.axis().dot(t.corner(k)), t.height(), 1e-12);
        EXPECT_TRUE(t.contains(v, 1e-12));
        EXPECT_FALSE(t.contains(-t.axis()));
    }
}

TEST(SphericalTriangle, RefusesWhatSpansNoSpace) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Vec3d x = Vec3d::UnitX(), y = Vec3d::UnitY(), z = Vec3d::UnitZ();
    EXPECT_FALSE(SphericalTriangle::make({x, y, Vec3d(x + y)}));
    EXPECT_FALSE(SphericalTriangle::make({x, x, y}));
    EXPECT_FALSE(SphericalTriangle::make({x, y, Vec3d::Zero()}));
    EXPECT_FALSE(SphericalTriangle::make({x, y, Vec3d(nan, 0, 1)}));
    EXPECT_TRUE(SphericalTriangle::make({Vec3d(1e-300 * x), Vec3d(1e300 * y), z}));
}

TEST(SphericalPatch, IsTheSumOfItsDefinition) {
    Random random(2);
    for (unsigned degree = 0; degree <= 8; ++degree)
        for (int i = 0; i < 60; ++i) {
            const SphericalPatch p = randomPatch(degree, random);
            const Vec3d v = i % 3 == 0 ? random.direction() : inside(p.domain(), random);
            // Outside coordinates are as large as the domain is thin: the terms that cancel are the scale.
            const double scale = std::pow(p.domain().coordinates(v).cwiseAbs().sum(), degree);
            EXPECT_NEAR(p.evaluate(v), bySum(p, v), 1e-12 * (1 + scale));
        }
}

TEST(SphericalPatch, PartsAreTheSamePolynomial) {
    Random random(3);
    for (unsigned degree = 0; degree <= 6; ++degree)
        for (int i = 0; i < 15; ++i) {
            const SphericalPatch p = randomPatch(degree, random);
            for (const SphericalPatch& part : p.split())
                for (int k = 0; k < 5; ++k) {
                    const Vec3d v = inside(part.domain(), random);
                    EXPECT_TRUE(p.domain().contains(v, 1e-12));
                    const double scale =
                        std::pow(1 / part.domain().height(), degree) + std::pow(1 / p.domain().height(), degree);
                    EXPECT_NEAR(part.evaluate(v), p.evaluate(v), 1e-11 * (1 + scale));
                }
        }
}

TEST(SphericalPatch, NeverLeavesItsRange) {
    for (const std::uint64_t seed : seeds(400)) {
        SCOPED_TRACE(deforming::repeat(seed, "SphericalPatch.NeverLeavesItsRange"));
        Random random(seed);
        const SphericalPatch p = randomPatch(random.below(7), random);
        for (unsigned splits = 0; splits <= 2; ++splits) {
            const RadialRange range = p.range(splits);
            for (int i = 0; i < 40; ++i) {
                const double value = p.evaluate(inside(p.domain(), random));
                const double rounding = 1e-12 * (1 + std::abs(range.lower) + std::abs(range.upper));
                ASSERT_GE(value, range.lower - rounding);
                ASSERT_LE(value, range.upper + rounding);
            }
        }
    }
}

TEST(SphericalPatch, NeedsItsFactor) {
    // All coefficients 1: in the middle of the octant the sum of the basis is 3, far above the largest coefficient.
    const SphericalTriangle octant = SphericalTriangle::make({Vec3d::UnitX(), Vec3d::UnitY(), Vec3d::UnitZ()}).value();
    const SphericalPatch p = SphericalPatch::make(octant, 2, std::vector<double>(6, 1.0)).value();
    EXPECT_NEAR(p.evaluate(Vec3d::Ones().normalized()), 3, 1e-12);
    EXPECT_NEAR(p.range().upper, 3, 1e-8);
    EXPECT_EQ(p.range().lower, 1);
}

TEST(SphericalPatch, RangesTightenFourfoldWithEachSplit) {
    const SphericalTriangle octant = SphericalTriangle::make({Vec3d::UnitX(), Vec3d::UnitY(), Vec3d::UnitZ()}).value();
    const SphericalPatch p = SphericalPatch::make(octant, 2, std::vector<double>(6, 1.0)).value();
    // The truth: 1 at the corners, 3 in the middle.
    double before = 0;
    for (unsigned splits = 1; splits <= 4; ++splits) {
        const RadialRange range = p.range(splits);
        const double excess = (range.upper - 3) + (1 - range.lower);
        EXPECT_GE(excess, 0);
        if (splits > 2) {
            EXPECT_LT(excess, 0.35 * before + 1e-7);
        }
        before = excess;
    }
}

TEST(SphericalPatch, OfEvenDegreeIsConstantWithTheSpheresOwnCoefficients) {
    Random random(4);
    for (int i = 0; i < 50; ++i) {
        const SphericalTriangle t = randomDomain(random);
        std::vector<double> c(6);
        // |v|² = 1 as a polar form: the dot product.
        for (unsigned a = 0; a <= 2; ++a)
            for (unsigned b = 0; a + b <= 2; ++b) {
                std::vector<std::size_t> corner;
                for (unsigned n = 0; n < 2; ++n) corner.push_back(n < a ? 0 : n < a + b ? 1 : 2);
                c[SphericalPatch::place(2, a, b)] = t.corner(corner[0]).dot(t.corner(corner[1]));
            }
        const SphericalPatch p = SphericalPatch::make(t, 2, c).value();
        for (int k = 0; k < 5; ++k) EXPECT_NEAR(p.evaluate(random.direction()), 1, 1e-9 / t.height());
    }
}

TEST(SphericalPatch, RefusesOtherCountsAndNumbers) {
    const SphericalTriangle octant = SphericalTriangle::make({Vec3d::UnitX(), Vec3d::UnitY(), Vec3d::UnitZ()}).value();
    EXPECT_FALSE(SphericalPatch::make(octant, 2, std::vector<double>(5)));
    EXPECT_FALSE(SphericalPatch::make(octant, 1, {1, 2, std::numeric_limits<double>::infinity()}));
    EXPECT_FALSE(SphericalPatch::make(octant, 13, std::vector<double>(SphericalPatch::coefficientCount(13))));
    EXPECT_TRUE(SphericalPatch::make(octant, 12, std::vector<double>(SphericalPatch::coefficientCount(12))));
}

TEST(SphereLayout, HasTheSizesOfAnOctahedronInFours) {
    const std::size_t corners[] = {6, 18, 66, 258, 1026};
    for (unsigned levels = 0; levels <= SphereLayout::kMostLevels; ++levels) {
        const SphereLayout layout(levels);
        const std::size_t triangles = std::size_t{8} << (2 * levels);
        EXPECT_EQ(layout.triangles().size(), triangles);
        // Corners, and an edge for each one and a half triangles.
        EXPECT_EQ(layout.directions().size(), corners[levels] + triangles * 3 / 2);
        for (std::size_t t = 0; t < triangles; ++t)
            for (std::size_t i = 0; i < 3; ++i)
                EXPECT_LT((layout.directions()[layout.points()[t][i]] - layout.triangles()[t].corner(i)).norm(), 1e-12);
    }
}

TEST(SphereLayout, LocatesEveryDirection) {
    Random random(5);
    for (unsigned levels = 0; levels <= 3; ++levels) {
        const SphereLayout layout(levels);
        for (int i = 0; i < 4000; ++i) {
            Vec3d v = random.uniform(0.001, 1000) * random.direction();
            if (i % 4 == 0) v[random.below(3)] = 0;
            if (i % 5 == 0)
                v = layout.directions()[random.below(layout.directions().size())] + 1e-13 * random.direction();
            const SpherePlace place = layout.locate(v);
            EXPECT_TRUE(layout.triangles()[place.triangle].contains(v, 1e-11));
            // Whoever is so far inside is in no other.
            for (std::size_t t = 0; place.margin > 1e-12 && t < layout.triangles().size(); ++t)
                EXPECT_EQ(layout.triangles()[t].contains(v), t == place.triangle);
        }
    }
    EXPECT_EQ(SphereLayout(2).locate(Vec3d::Zero()).margin, 0);
}

TEST(SphereLayout, VisitsEveryTriangleThatAFaceIsSeenIn) {
    for (const std::uint64_t seed : seeds(400)) {
        SCOPED_TRACE(deforming::repeat(seed, "SphereLayout.VisitsEveryTriangleThatAFaceIsSeenIn"));
        Random random(seed);
        const SphereLayout layout(random.below(3));
        Triangle face{random.inBox(1), random.inBox(1), random.inBox(1)};
        if (seed % 3 == 0) face = {face[0], Vec3d(face[0] + 0.05 * face[1]), Vec3d(face[0] + 0.05 * face[2])};
        if (seed % 7 == 0) face[2] = -face[0];  // through the centre
        if (seed % 11 == 0) face[1] = Vec3d::Zero();
        std::vector<bool> seen(layout.triangles().size());
        layout.visit(face, [&](std::uint32_t t) { seen[t] = true; });
        for (int i = 0; i < 200; ++i) {
            const Vec3d p = deforming::pointOf(face, random);
            // Nearer the centre the rounding of p turns it too far.
            if (p.norm() > 1e-2) {
                ASSERT_TRUE(seen[layout.locate(p).triangle]);
            }
        }
    }
}

}  // namespace
}  // namespace tessera
