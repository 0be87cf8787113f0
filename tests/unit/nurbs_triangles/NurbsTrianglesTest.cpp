/// Triangles of whole surfaces: closed forms, wild surfaces, neighbours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/freeform/nurbs/NurbsDistance.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "common/freeform/nurbs/tessellation/LeastCells.h"
#include "tests/support/words/Words.h"
#include "tests/unit/nurbs/NurbsOracle.h"
#include "tests/unit/nurbs_triangles/TrianglesOracle.h"

namespace tessera {
namespace {

std::string repeatTriangles(std::uint64_t seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_nurbs_triangles";
}

double sizeOf(const NurbsSurface& s) {
    Box box;
    for (const Vec4d& p : s.definition().points) box.extend(p.head<3>() / p.w());
    return box.size().norm();
}

/// A disc around the y axis: circles that shrink to its middle, the outer one that of a cylinder.
Expected<NurbsSurface> disc(double radius, double y) {
    const TrimCurve turn = circle(Vec2d::Zero(), 1);
    NurbsDefinition d{.u = turn.knots,
                      .v = {.degree = 1, .knots = {0, 0, 1, 1}},
                      .points = {},
                      .rangeU = {},
                      .rangeV = {},
                      .loops = {}};
    for (const double r : {radius, 0.0})
        for (const Vec3d& c : turn.points) d.points.emplace_back(c.x() * r, c.z() * y, -c.y() * r, c.z());
    return NurbsSurface::make(std::move(d));
}

TEST(NurbsTriangles, ASphereIsClosedAndAsNearAsItSays) {
    for (const double tolerance : {0.3, 0.02, 0.001}) {
        const auto t = tessellate(*sphereSurface(2), tolerance);
        ASSERT_TRUE(t) << t.error().message;
        EdgeCount edges;
        edges.add(*t);
        EXPECT_EQ(edges.wrong(), 0u);
        EXPECT_LE(t->error, tolerance);
        for (std::size_t i = 0; i < t->positions.size(); ++i) {
            ASSERT_NEAR(t->positions[i].norm(), 2, 1e-14);
            ASSERT_LT((t->normals[i] - 0.5 * t->positions[i]).norm(), 1e-7);  // near a pole derivatives nearly vanish
        }
        // Of a triangle the middle is farthest inside, or near it; the sphere bulges over each.
        for (const auto& c : t->triangles) {
            const Vec3d a = t->positions[c[0]], b = t->positions[c[1]], d = t->positions[c[2]],
                        normal = (b - a).cross(d - a);
            ASSERT_GT(normal.dot(a + b + d), 0) << "it faces inwards";
            ASSERT_LE(2 - std::abs(normal.normalized().dot(a)), t->error);
        }
    }
}

TEST(NurbsTriangles, ATorusIsClosedAndAsNearAsItSays) {
    const auto t = tessellate(*torusSurface(2, 0.5), 0.01);
    ASSERT_TRUE(t);
    EdgeCount edges;
    edges.add(*t);
    EXPECT_EQ(edges.wrong(), 0u);
    const auto off = [](const Vec3d& p) { return std::abs(std::hypot(std::hypot(p.x(), p.z()) - 2, p.y()) - 0.5); };
    for (const auto& c : t->triangles) {
        const Vec3d a = t->positions[c[0]], b = t->positions[c[1]], d = t->positions[c[2]];
        ASSERT_LT(off(a), 1e-14);
        ASSERT_LE(off((a + b + d) / 3), t->error);
        ASSERT_LE(off(0.5 * (a + b)), t->error);
    }
}

TEST(NurbsTriangles, ACylinderWithItsLidsCloses) {
    for (const double tolerance : {0.5, 0.03, 1e-4}) {
        EdgeCount edges;
        edges.add(*tessellate(*cylinderSurface(0.7, 1.3), tolerance));
        edges.add(*tessellate(*disc(0.7, 1.3), tolerance));
        edges.add(*tessellate(*disc(0.7, 0), tolerance), true);
        EXPECT_EQ(edges.wrong(), 0u) << tolerance;
    }
}

TEST(NurbsTriangles, AConeNeedsNoMoreThanItsCircleAsksForOverAndOver) {
    const auto t = tessellate(*coneSurface(1, 0, 2), 0.01);
    ASSERT_TRUE(t);
    for (const auto& c : t->triangles) {
        const Vec3d a = t->positions[c[0]], b = t->positions[c[1]], d = t->positions[c[2]];
        ASSERT_GT((b - a).cross(d - a).norm(), 0);
        for (const Vec3d& p : {a, b, d}) ASSERT_NEAR(std::hypot(p.x(), p.z()), 1 - p.y() / 2, 1e-14);
    }
    EXPECT_LT(t->triangles.size(), 2000u);
    EXPECT_LT(std::abs(areaOf(*t) - std::acos(-1.0) * std::sqrt(5.0)), 0.02);
}

TEST(NurbsTriangles, TheBytesAreTheSameOnEveryMachine) {
    EXPECT_EQ(hashOf(*tessellate(*torusSurface(2, 0.5), 0.05)), 15404405994652076971ull);
    EXPECT_EQ(hashOf(*tessellate(*sphereSurface(1, {{LoopRole::kHole, {circle({1.3, 1}, 0.6)}}}), 0.01)),
              622087670919131217ull);
}

TEST(NurbsTriangles, MoreThanIsAllowedIsRefused) {
    const auto t = tessellate(*sphereSurface(1), 1e-3, {.maxTriangles = 1000});
    ASSERT_FALSE(t);
    EXPECT_EQ(t.error().code, ErrorCode::kLimit);
    EXPECT_FALSE(tessellate(*sphereSurface(1), 0));
    EXPECT_FALSE(tessellate(*sphereSurface(1), std::numeric_limits<double>::quiet_NaN()));
    EXPECT_FALSE(tessellate(*sphereSurface(1e29), 1e-30));
}

/// Surfaces that curve, and some whose curvature changes its sign, from the seed.
NurbsSurface curvedSurface(std::uint64_t seed, std::mt19937_64& random) {
    const double size = std::pow(10.0, between(random, {-2, 2}));
    const TrimLoop hole{LoopRole::kHole, {circle({between(random, {1, 3}), 1}, between(random, {0.1, 0.6}))}};
    switch (seed % 5) {
        case 0:
            return sphereSurface(size).value();
        case 1:
            return sphereSurface(size, {hole}).value();
        case 2:
            return torusSurface(size, between(random, {0.3, 0.9}) * size).value();
        case 3:
            return cylinderSurface(size, 3 * size).value();
        default:
            break;
    }
    NurbsDefinition d;
    const int count = 6;
    d.u.degree = d.v.degree = 3;
    for (int k = 0; k < count + 4; ++k) d.u.knots.push_back(std::clamp(k - 3, 0, count - 3));
    d.v = d.u;
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i) {
            const double w = seed % 2 ? 1 : between(random, {0.5, 2});
            d.points.emplace_back(w * size * i, w * size * j, w * size * between(random, {-1, 1}), w);
        }
    return NurbsSurface::make(d).value();
}

TEST(NurbsTriangles, NoSurfaceHasFewerCellsThanAreSure) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(15); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const NurbsSurface s = curvedSurface(seed, random);
        for (const double share : {1e-2, 1e-3, 5e-4}) {
            const auto t = tessellate(s, share * sizeOf(s), {.maxTriangles = 200'000});
            if (!t) continue;
            const double sure = leastCells(s, onLattice(s).value(), share * sizeOf(s));
            // A cell at a pole has a triangle, all others two.
            ASSERT_LE(sure, static_cast<double>(t->triangles.size())) << repeatTriangles(seed);
            // It says something: cells go with 1 / tolerance, where the surface bends along both axes.
            if (seed % 5 == 3) continue;
            ASSERT_GE(leastCells(s, onLattice(s).value(), 1e-9 * sizeOf(s)),
                      static_cast<double>(t->triangles.size()) * (share / 1e-9) / 400)
                << repeatTriangles(seed);
        }
    }
}

TEST(NurbsTriangles, AToleranceThatIsFarTooSmallIsRefusedBeforeAnythingIsMadeAndOneThatDoesIsSaid) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(10); seed < end; ++seed) {
        if (seed % 5 == 3) continue;  // a cylinder takes its edges' points first
        std::mt19937_64 random(seed);
        const NurbsSurface s = curvedSurface(seed, random);
        constexpr std::size_t kMost = 50'000;
        // No sums but those of the patches themselves: what is refused was not halved.
        const auto refused = tessellate(s, 1e-9 * sizeOf(s), {.maxTriangles = kMost, .maxSums = 100'000});
        ASSERT_FALSE(refused) << repeatTriangles(seed);
        ASSERT_EQ(refused.error().code, ErrorCode::kLimit);
        const std::string& words = refused.error().message;
        const std::size_t at = words.find("about ");
        ASSERT_NE(at, std::string::npos) << words << repeatTriangles(seed);
        const auto would = tessellate(s, std::stod(words.substr(at + 6)), {.maxTriangles = kMost});
        ASSERT_TRUE(would) << words << "; but " << would.error().message << repeatTriangles(seed);
        ASSERT_GT(would->triangles.size(), 50U) << words;
    }
}

/// Between what is surely too small and what is fine lies what only halving tells.
TEST(NurbsTriangles, WhicheverToleranceIsTooSmallOneThatDoesIsSaid) {
    std::size_t told = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(10); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const NurbsSurface s = curvedSurface(seed, random);
        constexpr std::size_t kMost = 5'000;
        for (double share = 1e-2; share > 1e-9; share /= 4) {
            const double tolerance = share * sizeOf(s);
            const auto made = tessellate(s, tolerance, {.maxTriangles = kMost});
            if (made) {
                ASSERT_LE(made->triangles.size(), kMost) << repeatTriangles(seed);
                continue;
            }
            const std::string& words = made.error().message;
            const std::size_t at = words.find("about ");
            if (at == std::string::npos) continue;  // of its edges or trims
            ++told;
            const double better = std::stod(words.substr(at + 6));
            ASSERT_GT(better, tolerance) << words << repeatTriangles(seed);
            ASSERT_TRUE(tessellate(s, better, {.maxTriangles = kMost})) << words << repeatTriangles(seed);
        }
    }
    EXPECT_GT(told, seedCount(10));
}

/// Every place of the parameters is in one triangle, seen from the same side; no triangle and no place of the surface
/// is farther off than is said; what is open lies on an edge of the surface or of a jump.
void holdsForASurface(const NurbsSurface& s, double tolerance, bool collapsed, std::mt19937_64& random,
                      const std::string& repeat) {
    const auto t = tessellate(s, tolerance, {.maxTriangles = 30'000});
    if (!t) {
        ASSERT_EQ(t.error().code, ErrorCode::kLimit) << t.error().message << "\n" << repeat;
        return;
    }
    ASSERT_LE(t->error, tolerance) << repeat;
    const double size = sizeOf(s), rounding = 1e-13 * (size + s.definition().points.front().head<3>().norm());
    const double whole = s.domain().u.size() * s.domain().v.size();
    double area = 0;
    for (const auto& c : t->triangles) {
        const double part = parameterArea(*t, c);
        ASSERT_GT(part, -1e-10 * whole) << repeat;  // parameters far from 0 are rounded
        area += part;
    }
    // Triangles that a pole leaves without an area are not there.
    if (collapsed) {
        ASSERT_LE(area, whole * (1 + 1e-9)) << repeat;
    } else {
        ASSERT_NEAR(area, whole, 1e-9 * whole) << repeat;
    }
    const NurbsDistance distance(s);
    for (int k = 0; k < 12; ++k) {
        const double u = someParameter(random, s.definition().u), v = someParameter(random, s.definition().v);
        ASSERT_LE(distanceTo(*t, evaluate(s, u, v).at.point), t->error + rounding) << u << " " << v << "\n" << repeat;
        if (t->triangles.empty()) continue;
        const auto& c = t->triangles[random() % t->triangles.size()];
        double x = between(random, {0, 1}), y = between(random, {0, 1});
        if (x + y > 1) x = 1 - x, y = 1 - y;
        const auto mix = [&](const auto& of) { return ((1 - x - y) * of[c[0]] + x * of[c[1]] + y * of[c[2]]).eval(); };
        const Vec3d p = mix(t->positions);
        const Vec2d at = mix(t->parameters);
        if ((evaluate(s, at.x(), at.y()).at.point - p).norm() <= t->error + rounding) continue;
        const auto nearest = distance.closestPoint(p, 1e-3 * tolerance);
        ASSERT_TRUE(nearest) << repeat;
        ASSERT_LE(nearest->distance - nearest->error, t->error + rounding) << repeat;
    }
    for (std::size_t i = 0; i < t->normals.size(); ++i) ASSERT_NEAR(t->normals[i].norm(), 1, 1e-9) << repeat;
}

TEST(NurbsTriangles, WildSurfacesAreCoveredOnceAndAsNearAsIsSaid) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(60); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        NurbsDefinition d = someSurface(random, 4);
        // Some with weights from 1e-3 to 1e3, some with an edge that is a point, some closed.
        const auto countU = static_cast<std::size_t>(d.u.count()), countV = static_cast<std::size_t>(d.v.count());
        if (seed % 4 == 1)
            for (Vec4d& p : d.points) p *= std::pow(10.0, between(random, {-3, 3}));
        if (seed % 4 == 2)
            for (std::size_t i = 0; i < countU; ++i) d.points[i] = d.points[0];
        if (seed % 4 == 3 && countU > 3)
            for (std::size_t j = 0; j < countV; ++j) d.points[j * countU + countU - 1] = d.points[j * countU];
        const auto s = NurbsSurface::make(d);
        ASSERT_TRUE(s) << s.error().message;
        const double tolerance = sizeOf(*s) * std::pow(10.0, between(random, {-3, 0}));
        holdsForASurface(*s, tolerance, seed % 4 == 2, random, repeatTriangles(seed));
        if (testing::Test::HasFatalFailure()) return;
    }
}

TEST(NurbsTriangles, NothingInsideOfASurfaceIsOpen) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(60); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const auto s = NurbsSurface::make(someSurface(random, 4));
        ASSERT_TRUE(s);
        const auto t =
            tessellate(*s, sizeOf(*s) * std::pow(10.0, between(random, {-2.5, 0})), {.maxTriangles = 30'000});
        if (!t) continue;
        // By places; where the surface jumps, places of both sides are edges.
        const auto ends = [](const KnotVector& k, const ParameterRange& domain) {
            std::vector<double> at{domain.lower, domain.upper};
            for (const double x : k.knots)
                if (std::count(k.knots.begin(), k.knots.end(), x) > k.degree) at.push_back(x);
            return at;
        };
        const std::vector<double> endsU = ends(s->definition().u, s->domain().u),
                                  endsV = ends(s->definition().v, s->domain().v);
        std::map<Vec3d, Vec2d, PlaceOrder> parameterOf;
        std::map<std::pair<Vec3d, Vec3d>, int, decltype([](const auto& a, const auto& b) {
                     const PlaceOrder less;
                     return less(a.first, b.first) || (!less(b.first, a.first) && less(a.second, b.second));
                 })>
            times;
        for (const auto& c : t->triangles)
            for (std::size_t i = 0; i < 3; ++i) {
                parameterOf[t->positions[c[i]]] = t->parameters[c[i]];
                ++times[{t->positions[c[i]], t->positions[c[(i + 1) % 3]]}];
            }
        for (const auto& [edge, count] : times) {
            ASSERT_EQ(count, 1) << repeatTriangles(seed);
            if (times.contains({edge.second, edge.first})) continue;
            const Vec2d a = parameterOf[edge.first], b = parameterOf[edge.second];
            const auto both = [](double x, double y, const std::vector<double>& at) {
                return x == y && std::count(at.begin(), at.end(), x) > 0;
            };
            ASSERT_TRUE(both(a.x(), b.x(), endsU) || both(a.y(), b.y(), endsV))
                << a.transpose() << " to " << b.transpose() << "\n"
                << repeatTriangles(seed);
        }
    }
}

TEST(NurbsTriangles, SurfacesThatShareAnEdgeHaveTheSameVerticesThere) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(40); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const auto clamped = [&] {
            KnotVector k;
            do k = someKnots(random, 4);
            while (k.at(0) != k.at(k.degree) || k.at(k.count()) != k.at(k.count() + k.degree));
            return k;
        };
        NurbsDefinition a = someSurface(random, 4), b = someSurface(random, 4);
        const bool rational = random() % 2 == 0, turned = random() % 2 == 0;
        a.u = b.u = clamped();
        a.v = clamped();
        b.v = clamped();
        if (turned) {
            std::reverse(b.u.knots.begin(), b.u.knots.end());
            for (double& k : b.u.knots) k = -k;
        }
        const auto fill = [&](NurbsDefinition& d) {
            d.points.clear();
            for (int k = 0; k < d.u.count() * d.v.count(); ++k) {
                const double w = rational ? between(random, {0.2, 3}) : 1;
                d.points.emplace_back(w * between(random, {-1, 1}), w * between(random, {-1, 1}),
                                      w * between(random, {-1, 1}), w);
            }
        };
        fill(a);
        fill(b);
        const auto count = static_cast<std::size_t>(a.u.count());
        // The last row of one is the first of the other.
        for (std::size_t i = 0; i < count; ++i)
            b.points[turned ? count - 1 - i : i] = a.points[a.points.size() - count + i];
        const auto first = NurbsSurface::make(a), second = NurbsSurface::make(b);
        ASSERT_TRUE(first && second);
        const double tolerance = std::pow(10.0, between(random, {-2, -0.3}));
        const auto s = tessellate(*first, tolerance), t = tessellate(*second, tolerance);
        ASSERT_TRUE(s) << s.error().message;
        ASSERT_TRUE(t) << t.error().message;
        const auto along = [](const NurbsTriangles& n, double v) {
            std::vector<Vec3d> places;
            for (std::size_t i = 0; i < n.positions.size(); ++i)
                if (n.parameters[i].y() == v) places.push_back(n.positions[i]);
            std::sort(places.begin(), places.end(), PlaceOrder());
            places.erase(std::unique(places.begin(), places.end()), places.end());
            return places;
        };
        EXPECT_EQ(along(*s, first->domain().v.upper), along(*t, second->domain().v.lower)) << repeatTriangles(seed);
    }
}

/// A grid of count × count control points, bent by `bend`.
NurbsDefinition denseSurface(int degree, int count, double bend) {
    NurbsDefinition d;
    d.u.degree = degree;
    for (int k = 0; k < count + degree + 1; ++k) d.u.knots.push_back(k);
    d.v = d.u;
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i) d.points.emplace_back(i, j, bend * ((i + 2 * j) % 3), 1);
    return d;
}

TEST(NurbsTriangles, WhatWouldTakeTooLongIsRefused) {
    // All knots of it are needed, and their patches alone would be gigabytes: counted before one is made.
    const auto dense = NurbsSurface::make(denseSurface(24, 400, 0));
    ASSERT_TRUE(dense) << dense.error().message;
    constexpr std::size_t kSums = std::size_t{1} << 27;
    for (const double tolerance : {1e-3, 1e6}) {
        const auto refused = tessellate(*dense, tolerance, {.maxTriangles = 500'000, .maxSums = kSums});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
        EXPECT_WORDS(refused.error().message);
    }
    // Few knots, but so fine that it is halved again and again.
    const auto bent = NurbsSurface::make(denseSurface(12, 14, 1));
    ASSERT_TRUE(bent);
    const auto whole = tessellate(*bent, 0.5);
    ASSERT_TRUE(whole) << whole.error().message;
    std::size_t enough = 1;
    while (!tessellate(*bent, 0.5, {.maxSums = enough})) enough *= 2;
    EXPECT_GT(enough, 1000U);
    EXPECT_LT(enough, std::size_t{1} << 27);
    EXPECT_EQ(tessellate(*bent, 0.5, {.maxSums = enough})->positions, whole->positions)
        << "what is counted changes nothing";
    const auto finer = tessellate(*bent, 1e-4, {.maxSums = enough});
    ASSERT_FALSE(finer);
    EXPECT_EQ(finer.error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace tessera
