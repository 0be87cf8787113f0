/// Surfaces beside the Cox-de Boor recursion in long double. A failing seed: TESSERA_SEED=N build/bin/unit_nurbs.
#include "common/freeform/nurbs/NurbsSurface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "common/freeform/PatchBounds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/nurbs/NurbsOracle.h"

namespace tessera {
namespace {

/// Coordinates are up to 1 and weights 0.2 to 3: at degree 12 some 100 roundings of 1e-16, times the weights' ratio.
constexpr double kRounding = 1e-13;

TEST(NurbsSurfaces, AreTheCoxDeBoorSumWithAnyKnots) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(400); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const NurbsDefinition d = someSurface(random, seed % 10 == 0 ? 12 : 5);
        if (!(d.u.domain().size() > 0 && d.v.domain().size() > 0)) continue;
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_TRUE(surface) << surface.error().message << " TESSERA_SEED=" << seed;
        for (int k = 0; k < 12; ++k) {
            const double u = someParameter(random, d.u), v = someParameter(random, d.v);
            const NurbsPoint p = evaluate(*surface, u, v);
            EXPECT_EQ(p.side, TrimSide::kKept);
            ASSERT_LT((p.at.point - byCoxDeBoor(d, u, v)).norm(), kRounding)
                << u << " " << v << " TESSERA_SEED=" << seed;
        }
    }
}

TEST(NurbsSurfaces, DerivativesAreDifferencesInsideOfSpans) {
    int compared = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(200); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const NurbsDefinition d = someSurface(random);
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        if (!surface) continue;
        for (int k = 0; k < 6; ++k) {
            const double u = between(random, d.u.domain()), v = between(random, d.v.domain());
            const int spanU = spanAt(d.u, u), spanV = spanAt(d.v, v);
            const double hU = 1e-5 * (d.u.at(spanU + 1) - d.u.at(spanU)),
                         hV = 1e-5 * (d.v.at(spanV + 1) - d.v.at(spanV));
            if (spanAt(d.u, u - hU) != spanU || spanAt(d.u, u + hU) != spanU || spanAt(d.v, v - hV) != spanV ||
                spanAt(d.v, v + hV) != spanV)
                continue;
            const SurfacePoint p = evaluate(*surface, u, v).at;
            // By span: third derivatives of degree 5 times 1e-10, and rounding over 1e-5.
            ASSERT_LT((2 * hU * p.du - (byCoxDeBoor(d, u + hU, v) - byCoxDeBoor(d, u - hU, v))).norm(),
                      1e-5 * 2e-5 * 100)
                << "TESSERA_SEED=" << seed;
            ASSERT_LT((2 * hV * p.dv - (byCoxDeBoor(d, u, v + hV) - byCoxDeBoor(d, u, v - hV))).norm(),
                      1e-5 * 2e-5 * 100)
                << "TESSERA_SEED=" << seed;
            if (!p.normal.isZero()) {
                EXPECT_NEAR(p.normal.norm(), 1, 1e-14);
                EXPECT_GT(p.normal.dot(p.du.cross(p.dv)), 0) << "TESSERA_SEED=" << seed;
            }
            ++compared;
        }
    }
    EXPECT_GT(compared, std::getenv("TESSERA_SEED") ? 0 : 500);
}

TEST(NurbsSurfaces, TheirPatchesAreTheSurface) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(300); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        NurbsDefinition d = someSurface(random);
        if (!(d.u.domain().size() > 0 && d.v.domain().size() > 0)) continue;
        if (seed % 2 == 0) {
            const ParameterRange u = d.u.domain();
            d.rangeU = {u.lower + 0.3 * u.size(), u.upper - 0.1 * u.size()};
        }
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_TRUE(surface) << surface.error().message;
        const std::vector<ParameterPatch> patches = bezierPatches(*surface);
        double area = 0;
        for (const ParameterPatch& p : patches) {
            area += p.over.u.size() * p.over.v.size();
            for (int k = 0; k < 4; ++k) {
                // Inside: on a knot a surface may jump.
                const double s = between(random, {0.01, 0.99}), t = between(random, {0.01, 0.99});
                const double u = p.over.u.lower + s * p.over.u.size(), v = p.over.v.lower + t * p.over.v.size();
                const SurfacePoint there = evaluate(*surface, u, v).at, here = evaluate(p.patch, s, t);
                // The parameters are rounded: half of 2^-52 each in the product and the sum.
                const double moved = std::ldexp(std::abs(u) * there.du.norm() + std::abs(v) * there.dv.norm(), -51);
                ASSERT_LT((here.point - there.point).norm(), kRounding + moved) << "TESSERA_SEED=" << seed;
                ASSERT_LT((here.du - p.over.u.size() * there.du).norm(), 1e-6 * (1 + here.du.norm()))
                    << "TESSERA_SEED=" << seed;
            }
        }
        const ParameterRectangle& domain = surface->domain();
        EXPECT_NEAR(area, domain.u.size() * domain.v.size(), 1e-9 * area) << "TESSERA_SEED=" << seed;
    }
}

TEST(NurbsSurfaces, PatchesShareTheBitsOfACommonEdge) {
    int edges = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(200); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const NurbsDefinition d = someSurface(random);
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        if (!surface) continue;
        const std::vector<ParameterPatch> patches = bezierPatches(*surface);
        for (const ParameterPatch& a : patches)
            for (const ParameterPatch& b : patches) {
                const bool alongU = a.over.v == b.over.v && a.over.u.upper == b.over.u.lower,
                           alongV = a.over.u == b.over.u && a.over.v.upper == b.over.v.lower;
                if (!alongU && !alongV) continue;
                const KnotVector& knots = alongU ? d.u : d.v;
                const double knot = alongU ? b.over.u.lower : b.over.v.lower;
                if (std::count(knots.knots.begin(), knots.knots.end(), knot) > knots.degree) continue;
                const int last = alongU ? d.v.degree : d.u.degree;
                for (int k = 0; k <= last; ++k)
                    ASSERT_EQ(alongU ? a.patch.at(d.u.degree, k) : a.patch.at(k, d.v.degree),
                              alongU ? b.patch.at(0, k) : b.patch.at(k, 0))
                        << "TESSERA_SEED=" << seed;
                ++edges;
            }
    }
    EXPECT_GT(edges, std::getenv("TESSERA_SEED") ? 0 : 300);
}

TEST(NurbsSurfaces, AreRefusedInWords) {
    const auto good = [] {
        NurbsDefinition d{.u = {2, {0, 0, 0, 1, 2, 2, 2}},
                          .v = {1, {0, 0, 1, 1}},
                          .points = {},
                          .rangeU = {},
                          .rangeV = {},
                          .loops = {}};
        for (int i = 0; i < 8; ++i) d.points.emplace_back(i % 4, 0, i / 4, 1);
        return d;
    };
    ASSERT_TRUE(NurbsSurface::make(good()));
    const auto says = [&](const std::function<void(NurbsDefinition&)>& spoil) {
        NurbsDefinition d = good();
        spoil(d);
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_FALSE(surface);
        EXPECT_EQ(surface.error().code, ErrorCode::kBadInput);
        EXPECT_WORDS(surface.error().message);
    };
    constexpr double kInfinity = std::numeric_limits<double>::infinity(),
                     kNone = std::numeric_limits<double>::quiet_NaN();
    says([](auto& d) { d.u.degree = 0; });
    says([](auto& d) { d.u.degree = -7; });
    says([](auto& d) { d.u.degree = 1000000000; });
    says([](auto& d) { d.u.knots.clear(); });
    says([](auto& d) { d.u.knots.pop_back(); });
    says([](auto& d) { d.points.pop_back(); });
    says([](auto& d) { d.points.clear(); });
    says([](auto& d) { d.u.knots[3] = -1; });
    says([](auto& d) { d.u.knots[3] = kNone; });
    says([](auto& d) { d.u.knots[6] = kInfinity; });
    says([](auto& d) { d.u.knots = {0, 0, 0, 0, 2, 2, 2}; });
    says([](auto& d) { d.v.knots = {0, 0, 0, 1}; });
    says([](auto& d) { d.v.knots = {0, 1, 1, 2}; });
    says([](auto& d) { d.u.knots[3] = 1e-40; });
    says([](auto& d) { d.points[5].w() = 0; });
    says([](auto& d) { d.points[5].w() = -1; });
    says([](auto& d) { d.points[5].w() = kNone; });
    says([](auto& d) { d.points[0].x() = kInfinity; });
    says([](auto& d) { d.rangeU = {1, 1}; });
    says([](auto& d) { d.rangeU = {kNone, 1}; });
    says([](auto& d) { d.rangeV = {0, 1.5}; });
}

TEST(NurbsSurfaces, AnswerOutsideOfTheirDomainWithTheNearestPointOfIt) {
    std::mt19937_64 random(3);
    const NurbsDefinition d{.u = {1, {0, 0, 1, 1}},
                            .v = {1, {0, 0, 1, 1}},
                            .points = {{0, 0, 0, 1}, {1, 0, 0, 1}, {0, 1, 0, 1}, {1, 1, 0, 1}},
                            .rangeU = {},
                            .rangeV = {},
                            .loops = {}};
    const NurbsSurface surface = *NurbsSurface::make(d);
    constexpr double kInfinity = std::numeric_limits<double>::infinity(),
                     kNone = std::numeric_limits<double>::quiet_NaN();
    const auto at = [&](double u, double v) {
        const NurbsPoint p = evaluate(surface, u, v);
        EXPECT_EQ(p.side, TrimSide::kTrimmedAway);
        EXPECT_EQ(p.at.normal, Vec3d(0, 0, 1));
        return p.at.point;
    };
    EXPECT_EQ(at(-1, 0.5), Vec3d(0, 0.5, 0));
    EXPECT_EQ(at(kInfinity, 1.5), Vec3d(1, 1, 0));
    EXPECT_EQ(at(0.25, -kInfinity), Vec3d(0.25, 0, 0));
    EXPECT_EQ(at(kNone, kNone), Vec3d(0, 0, 0));
}

TEST(NurbsSurfaces, AreFiniteAtTheExtremesOfWhatIsTaken) {
    // Coordinates to 1e30, weights of a ratio of 1e24, spans of 1e-30 beside ones of 1, the highest degree.
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(100); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        NurbsDefinition d{.u = {kMaxNurbsDegree, {}},
                          .v = {2, {0, 0, 0, 1e-30, 2e-30, 1, 1, 1}},
                          .points = {},
                          .rangeU = {},
                          .rangeV = {},
                          .loops = {}};
        for (const double knot : {-1e-30, 1e-30})
            for (int k = 0; k <= kMaxNurbsDegree; ++k) d.u.knots.push_back(knot);
        for (int i = 0; i < d.u.count() * d.v.count(); ++i) {
            const double w = std::pow(10, between(random, {-12, 12}));
            const Vec3d p = 1e30 * Vec3d(between(random, {-1, 1}), between(random, {-1, 1}), between(random, {-1, 1}));
            d.points.emplace_back(w * p.x(), w * p.y(), w * p.z(), w);
        }
        const Expected<NurbsSurface> surface = NurbsSurface::make(d);
        ASSERT_TRUE(surface) << surface.error().message;
        for (int k = 0; k < 20; ++k) {
            const double s = k == 0   ? 0
                             : k == 1 ? 1
                                      : between(random, {0, 1}),
                         v = k % 4 == 0 ? 1.5e-30 : between(random, {0, 1});
            const SurfacePoint p = evaluate(*surface, 1e-30 * (2 * s - 1), v).at;
            ASSERT_TRUE(p.du.allFinite() && p.dv.allFinite() && p.normal.allFinite()) << "TESSERA_SEED=" << seed;
            // Bernstein along u, as the recursion would take 2^24 steps. A convex sum of coordinates to 1e30 is off by
            // some of their roundings, and u by one of its own: whatever the weights, it moves the point by no more
            // than 24 / (t (1 − t)) times as much.
            Eigen::Matrix<long double, 4, 1> sum = Eigen::Matrix<long double, 4, 1>::Zero();
            const long double t = (1e-30L * static_cast<long double>(2 * s - 1) + 1e-30L) / 2e-30L;
            for (int i = 0; i <= kMaxNurbsDegree; ++i) {
                long double along = 1;
                for (int c = 1; c <= i; ++c) along *= t * (kMaxNurbsDegree - i + c) / c;
                for (int c = i; c < kMaxNurbsDegree; ++c) along *= 1 - t;
                for (int j = 0; j < d.v.count(); ++j)
                    sum += along * coxDeBoor(d.v, j, 2, v) *
                           d.points[static_cast<std::size_t>(j * d.u.count() + i)].cast<long double>();
            }
            ASSERT_LT(
                (p.point - (sum.head<3>() / sum.w()).cast<double>()).norm(),
                1e30 * (1e-13 + (t > 0 && t < 1 ? 1e-15 * kMaxNurbsDegree / static_cast<double>(t * (1 - t)) : 0)))
                << s << " " << v << " TESSERA_SEED=" << seed;
        }
        for (const ParameterPatch& p : bezierPatches(*surface))
            EXPECT_TRUE(evaluate(p.patch, 0.3, 0.7).normal.allFinite() && std::isfinite(bilinearDeviation(p.patch)));
    }
}

TEST(NurbsSurfaces, JumpWhereAKnotHasFullMultiplicity) {
    // Two flat pieces at heights 0 and 1.
    NurbsDefinition d{
        .u = {1, {0, 0, 1, 1, 2, 2}}, .v = {1, {0, 0, 1, 1}}, .points = {}, .rangeU = {}, .rangeV = {}, .loops = {}};
    for (const double y : {0.0, 1.0})
        for (const double x : {0.0, 1.0, 1.0, 2.0}) d.points.emplace_back(x, y, d.points.size() % 4 < 2 ? 0 : 1, 1);
    const NurbsSurface surface = *NurbsSurface::make(d);
    EXPECT_EQ(evaluate(surface, 1, 0.5).at.point, Vec3d(1, 0.5, 1));
    EXPECT_EQ(evaluate(surface, std::nextafter(1, 0), 0.5).at.point.z(), 0);
    const std::vector<ParameterPatch> patches = bezierPatches(surface);
    ASSERT_EQ(patches.size(), 2u);
    EXPECT_EQ(patches[0].patch.at(1, 0), Vec4d(1, 0, 0, 1));
    EXPECT_EQ(patches[1].patch.at(0, 0), Vec4d(1, 0, 1, 1));
}

}  // namespace
}  // namespace tessera
