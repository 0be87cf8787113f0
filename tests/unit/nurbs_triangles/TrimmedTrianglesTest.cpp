/// Triangles of trimmed surfaces: what circles leave of a plane, thin rings, loops that nobody can make sense of.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/support/words/Words.h"
#include "tests/unit/nurbs/NurbsOracle.h"
#include "tests/unit/nurbs/Plane.h"
#include "tests/unit/nurbs_triangles/TrianglesOracle.h"

namespace tessera {
namespace {

constexpr double kPi = 3.14159265358979323846;
const ParameterRectangle kSquare{{-2, 2}, {-2, 2}};

std::string repeatTrims(std::uint64_t seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_nurbs_triangles";
}

TEST(TrimmedTriangles, CirclesLeaveOfAPlaneWhatTheyDoInFormulas) {
    for (const double tolerance : {0.1, 1e-3, 1e-5}) {
        // A ring, and an island in its hole.
        const auto t = tessellate(*planeSurface(kSquare, {{LoopRole::kOuter, {circle({0, 0}, 1.5)}},
                                                          {LoopRole::kHole, {circle({0.2, 0}, 1)}},
                                                          {LoopRole::kOuter, {circle({0.1, 0.1}, 0.5)}}}),
                                  tolerance);
        ASSERT_TRUE(t) << t.error().message;
        EXPECT_LE(t->error, tolerance);
        EXPECT_NEAR(areaOf(*t), kPi * (1.5 * 1.5 - 1 + 0.25), 2 * kPi * 3 * tolerance);
        for (const auto& c : t->triangles) ASSERT_GT(parameterArea(*t, c), 0);
    }
}

/// Rings as thin as 1e-9, wherever, beside a tolerance that is much larger than they are: no chord crosses another.
TEST(TrimmedTriangles, ThinRingsStayRings) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(60); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const double thin = std::pow(10.0, between(random, {-9, -1})), radius = between(random, {0.3, 0.9});
        const Vec2d center(between(random, {-1, 1}), between(random, {-1, 1}));
        const double tolerance = std::pow(10.0, between(random, {-4, 0}));
        const auto t = tessellate(*planeSurface(kSquare, {{LoopRole::kOuter, {circle(center, radius)}},
                                                          {LoopRole::kHole, {circle(center, radius * (1 - thin))}}}),
                                  tolerance);
        ASSERT_TRUE(t) << t.error().message << "\n" << repeatTrims(seed);
        double area = 0;
        for (const auto& c : t->triangles) {
            ASSERT_GT(parameterArea(*t, c), 0) << repeatTrims(seed);
            area += parameterArea(*t, c);
        }
        ASSERT_GT(area, 0) << repeatTrims(seed);
        EXPECT_NEAR(area, kPi * radius * radius * (1 - (1 - thin) * (1 - thin)), 4 * kPi * radius * tolerance)
            << repeatTrims(seed);
        // Two boundaries that close: as many edges in and out of each vertex.
        EdgeCount edges;
        edges.add(*t);
        for (const Vec3d& p : t->positions) {
            const double r = (p.head<2>() - center).norm();
            EXPECT_TRUE(r < radius + 1e-9 && r > radius * (1 - thin) - tolerance) << repeatTrims(seed);
        }
    }
}

/// On curved surfaces of several spans: what is kept is near what the exact region keeps.
TEST(TrimmedTriangles, OfTrimmedSurfacesTheTrianglesAreAsNearAsIsSaid) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(40); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const bool sphere = random() % 2 == 0;
        const Vec2d center(between(random, {1, 3}), sphere ? between(random, {0.9, 1.1}) : between(random, {1, 3}));
        const double radius = between(random, {0.05, 0.8}), tolerance = std::pow(10.0, between(random, {-2.5, -0.5}));
        const std::vector<TrimLoop> loops{
            {random() % 2 == 0 ? LoopRole::kHole : LoopRole::kOuter, {circle(center, radius)}}};
        const auto s = sphere ? sphereSurface(1, loops) : torusSurface(1, 0.3, loops);
        ASSERT_TRUE(s);
        const auto t = tessellate(*s, tolerance);
        ASSERT_TRUE(t) << t.error().message << "\n" << repeatTrims(seed);
        ASSERT_LE(t->error, tolerance);
        for (int k = 0; k < 40; ++k) {
            const NurbsPoint p = evaluate(*s, between(random, s->domain().u), between(random, s->domain().v));
            if (p.side == TrimSide::kKept) {
                ASSERT_LE(distanceTo(*t, p.at.point), t->error + 1e-12) << repeatTrims(seed);
            }
        }
        // A triangle's corners are kept, or as near to what is kept as half of the tolerance: looked for around each.
        for (std::size_t i = 0; i < t->positions.size(); ++i) {
            const Vec2d at = t->parameters[i], out = at - center;
            if (s->region().side(at) != TrimSide::kTrimmedAway) continue;
            const double rim = radius * (loops[0].role == LoopRole::kHole ? 1 + 1e-9 : 1 - 1e-9);
            const Vec2d nearest = center + rim * out.normalized();
            ASSERT_LE((evaluate(*s, nearest.x(), nearest.y()).at.point - t->positions[i]).norm(),
                      0.5 * tolerance + 1e-9)
                << repeatTrims(seed);
        }
    }
}

TEST(TrimmedTriangles, ALoopAlongTheEdgesChangesNothingThere) {
    const auto vertices = [](const Expected<NurbsTriangles>& t) {
        EXPECT_TRUE(t);
        std::vector<Vec3d> places = t->positions;
        std::sort(places.begin(), places.end(), PlaceOrder());
        return places;
    };
    // In pieces that the edges are not cut at.
    const std::array<Vec2d, 7> around{Vec2d(0, 0), Vec2d(0.3, 0), Vec2d(3.1, 0), Vec2d(4, 0),
                                      Vec2d(4, 1), Vec2d(0, 1),   Vec2d(0, 0)};
    EXPECT_EQ(vertices(tessellate(*cylinderSurface(1, 2), 0.01)),
              vertices(tessellate(*cylinderSurface(1, 2, {{LoopRole::kOuter, {polyline(around)}}}), 0.01)));
}

void isRefused(const std::vector<TrimLoop>& loops) {
    const auto t = tessellate(*planeSurface(kSquare, loops), 1e-3);
    ASSERT_FALSE(t);
    EXPECT_EQ(t.error().code, ErrorCode::kBadInput);
    EXPECT_WORDS(t.error().message);
}

TEST(TrimmedTriangles, LoopsThatCrossOrLeaveAreRefusedByName) {
    const std::array<Vec2d, 5> bow{Vec2d(-1, -1), Vec2d(1, 1), Vec2d(1, -1), Vec2d(-1, 1), Vec2d(-1, -1)};
    isRefused({{LoopRole::kOuter, {polyline(bow)}}});
    isRefused({{LoopRole::kOuter, {circle({0, 0}, 1)}}, {LoopRole::kHole, {circle({0.2, 0}, 1)}}});
    isRefused({{LoopRole::kOuter, {circle({0, 0}, 1)}}, {LoopRole::kHole, {circle({0, 0}, 1)}}});
    isRefused({{LoopRole::kHole, {circle({1.5, 0}, 1)}}});
    const std::array<Vec2d, 4> spike{Vec2d(-1, -1), Vec2d(1, 1), Vec2d(0, 0), Vec2d(-1, -1)};
    isRefused({{LoopRole::kOuter, {polyline(spike)}}});
}

/// Circles at random: refused if they cross by more than the tolerance, and only if they cross.
TEST(TrimmedTriangles, OfTwoCirclesThoseThatCrossAreRefused) {
    int crossed = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(150); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const Vec2d a(between(random, {-0.5, 0.5}), between(random, {-0.5, 0.5})),
            b(between(random, {-0.5, 0.5}), between(random, {-0.5, 0.5}));
        const double r = between(random, {0.1, 1}), q = between(random, {0.1, 1}), apart = (a - b).norm();
        const bool cross = apart < r + q && apart > std::abs(r - q);
        if (std::min(std::abs(apart - r - q), std::abs(apart - std::abs(r - q))) < 1e-3) continue;
        const auto t = tessellate(
            *planeSurface(kSquare, {{LoopRole::kHole, {circle(a, r)}}, {LoopRole::kHole, {circle(b, q)}}}), 1e-4);
        EXPECT_EQ(!t, cross) << repeatTrims(seed);
        crossed += cross;
    }
    if (seedCount(2) == 2) {
        EXPECT_GT(crossed, 25);
    }
}

}  // namespace
}  // namespace tessera
