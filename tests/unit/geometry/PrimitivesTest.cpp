#include "common/geometry/Primitives.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace tessera {
namespace {

using Numbers = std::vector<std::uint32_t>;

/// So many vertices, each somewhere else.
std::vector<float> placesOf(std::size_t vertices) {
    std::vector<float> places;
    for (std::size_t i = 0; i < vertices; ++i)
        places.insert(places.end(), {static_cast<float>(i), static_cast<float>(i * i), static_cast<float>(i % 3)});
    return places;
}

Numbers assembledBy(RunKind kind, std::size_t vertices, const Numbers& indices = {}, const Numbers& lengths = {}) {
    const std::vector<float> places = placesOf(vertices);
    const PrimitiveRuns runs{.kind = kind, .positions = places, .indices = indices, .lengths = lengths};
    EXPECT_TRUE(checkRuns(runs));
    return *assembleRuns(runs);
}

std::string refusalOf(RunKind kind, std::size_t vertices, const Numbers& indices = {}, const Numbers& lengths = {},
                      const MeshLimits& limits = {}) {
    const std::vector<float> places = placesOf(vertices);
    const Expected<void> sound =
        checkRuns({.kind = kind, .positions = places, .indices = indices, .lengths = lengths}, limits);
    return sound ? "it is sound" : sound.error().message;
}

TEST(Primitives, StripsAndLoopsAreLines) {
    EXPECT_EQ(assembledBy(RunKind::kLineStrips, 4), (Numbers{0, 1, 1, 2, 2, 3}));
    EXPECT_EQ(assembledBy(RunKind::kLineStrips, 5, {}, {2, 3}), (Numbers{0, 1, 2, 3, 3, 4}));
    EXPECT_EQ(assembledBy(RunKind::kLineLoops, 3), (Numbers{0, 1, 1, 2, 2, 0}));
    EXPECT_EQ(assembledBy(RunKind::kLineLoops, 9, {8, 1, 4, 3, 2, 6, 7}, {3, 4}),
              (Numbers{8, 1, 1, 4, 4, 8, 3, 2, 2, 6, 6, 7, 7, 3}));
}

TEST(Primitives, StripsAlternateAndFansKeepTheirFirstCorner) {
    EXPECT_EQ(assembledBy(RunKind::kTriangleStrips, 5), (Numbers{0, 1, 2, 2, 1, 3, 2, 3, 4}));
    EXPECT_EQ(assembledBy(RunKind::kTriangleStrips, 7, {}, {3, 4}), (Numbers{0, 1, 2, 3, 4, 5, 5, 4, 6}))
        << "the second begins anew";
    EXPECT_EQ(assembledBy(RunKind::kTriangleFans, 5), (Numbers{0, 1, 2, 0, 2, 3, 0, 3, 4}));
    EXPECT_EQ(assembledBy(RunKind::kTriangleFans, 4, {3, 0, 1, 2}), (Numbers{3, 0, 1, 3, 1, 2}));
    EXPECT_EQ(assembledBy(RunKind::kQuadStrips, 6), (Numbers{0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4}));
}

TEST(Primitives, CornersNamedTwiceJoinStripsAndAreNoTriangles) {
    // 0 1 2 3, then 4 5 6 7, joined by 3 and 4 twice: OpenGL's way of one strip for two.
    EXPECT_EQ(assembledBy(RunKind::kTriangleStrips, 8, {0, 1, 2, 3, 3, 4, 4, 5, 6, 7}),
              (Numbers{0, 1, 2, 2, 1, 3, 4, 5, 6, 6, 5, 7}));
}

TEST(Primitives, AQuadIsCutWhereItIsInside) {
    const auto cut = [](std::vector<float> places) {
        return *assembleRuns({.kind = RunKind::kQuads, .positions = places, .indices = {}, .lengths = {}});
    };
    EXPECT_EQ(cut({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}), (Numbers{0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(cut({0, 0, 0, 2, 1, 0, 4, 0, 0, 2, 4, 0}), (Numbers{0, 1, 3, 1, 2, 3})) << "concave at its second corner";
    EXPECT_EQ(cut({0, 0, 0, 2, -4, 0, 4, 0, 0, 2, -1, 0}), (Numbers{0, 1, 3, 1, 2, 3})) << "at its fourth";
    EXPECT_EQ(cut({2, 1, 0, 4, 0, 0, 2, 4, 0, 0, 0, 0}), (Numbers{0, 1, 2, 0, 2, 3})) << "at its first";
    EXPECT_EQ(cut({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}), (Numbers{0, 1, 2, 0, 2, 3})) << "crossing itself";
    EXPECT_EQ(cut(std::vector<float>(12, 3.0F)), (Numbers{0, 1, 2, 0, 2, 3})) << "one place";
}

TEST(Primitives, SayWhatIsWrongWithThem) {
    EXPECT_EQ(refusalOf(RunKind::kPolygons, 5, {}, {3, 2}), "polygon 1 has 2 corners: it takes at least 3");
    EXPECT_EQ(refusalOf(RunKind::kPolygons, 5, {}, {3, 3}),
              "the lengths of 2 polygons add up to 6 corners, but there are 5");
    EXPECT_EQ(refusalOf(RunKind::kTriangleFans, 4, {0, 1, 9}),
              "corner 2 of the triangle fans names vertex 9, but there are 4 vertices");
    EXPECT_EQ(refusalOf(RunKind::kQuads, 6), "6 corners are no whole number of quads");
    EXPECT_EQ(refusalOf(RunKind::kQuadStrips, 5), "quad strip 0 has 5 corners: it takes an even number from 4");
    EXPECT_EQ(refusalOf(RunKind::kLineStrips, 3, {}, {1, 2}), "line strip 0 has 1 corner: it takes at least 2");
    EXPECT_EQ(refusalOf(RunKind::kLineLoops, 3, {}, {0, 3}), "line loop 0 has 0 corners: it takes at least 3");
    EXPECT_EQ(refusalOf(RunKind::kPolygons, 4, {}, {~0U, 5}),
              "the lengths of 2 polygons add up to 4294967300 corners, but there are 4")
        << "no sum overflows";
    EXPECT_WORDS(refusalOf(RunKind::kTriangleStrips, 9, {}, {}, {.maxTriangles = 8}));
}

struct Scattered {
    std::vector<float> positions;
    Numbers lengths;
    std::vector<Vec3d> normals;  ///< of each polygon, as long as it is large
};

/// Star-shaped polygons anywhere, turned anyhow, somewhat off their planes.
Scattered somePolygons(std::mt19937_64& random, double offPlane) {
    const auto share = [&] { return static_cast<double>(random() % 10001) / 10000; };
    Scattered made;
    for (std::uint64_t polygons = 1 + random() % 6; polygons > 0; --polygons) {
        const std::size_t corners = 3 + random() % 40;
        const Vec3d out = Vec3d(share() - 0.5, share() - 0.5, share() - 0.5).normalized(), aside = out.unitOrthogonal(),
                    up = out.cross(aside);
        const double size = std::exp(10 * share() - 5);
        const Vec3d middle = 3 * size * Vec3d(share(), share(), share());
        Vec3d normal = Vec3d::Zero();
        std::vector<Vec3d> places;
        for (std::size_t i = 0; i < corners; ++i) {
            const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners),
                         radius = size * (0.2 + share());
            const Vec3f at = (middle + radius * std::cos(angle) * aside + radius * std::sin(angle) * up +
                              offPlane * size * (share() - 0.5) * out)
                                 .cast<float>();
            made.positions.insert(made.positions.end(), {at.x(), at.y(), at.z()});
            places.push_back(at.cast<double>());
        }
        for (std::size_t i = 0; i < corners; ++i)
            normal += 0.5 * (places[i] - middle).cross(places[(i + 1) % corners] - middle);
        made.lengths.push_back(static_cast<std::uint32_t>(corners));
        made.normals.push_back(normal);
    }
    return made;
}

TEST(Primitives, PolygonsKeepTheirAreaAndTheirSide) {
    const char* one = std::getenv("TESSERA_SEED");
    for (std::uint64_t seed = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? seed : 200; seed <= last;
         ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_geometry --gtest_filter=Primitives.*");
        std::mt19937_64 random(seed);
        const Scattered polygons = somePolygons(random, seed % 2 == 0 ? 0 : 0.05);
        const PrimitiveRuns runs{
            .kind = RunKind::kPolygons, .positions = polygons.positions, .indices = {}, .lengths = polygons.lengths};
        ASSERT_TRUE(checkRuns(runs));
        const Numbers triangles = *assembleRuns(runs);
        std::size_t slot = 0, first = 0;
        for (std::size_t p = 0; p < polygons.lengths.size(); ++p) {
            const std::size_t corners = polygons.lengths[p];
            Vec3d sum = Vec3d::Zero();
            double absolute = 0;
            const Vec3d& normal = polygons.normals[p];
            for (std::size_t t = 0; t < corners - 2; ++t, slot += 3) {
                std::array<Vec3d, 3> c;
                for (std::size_t k = 0; k < 3; ++k) {
                    ASSERT_GE(triangles[slot + k], first) << "its triangles are numbers of its own";
                    ASSERT_LT(triangles[slot + k], first + corners);
                    for (Eigen::Index x = 0; x < 3; ++x)
                        c[k][x] = polygons.positions[3 * triangles[slot + k] + static_cast<std::size_t>(x)];
                }
                const Vec3d area = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]);
                sum += area;
                absolute += seed % 2 == 0 ? area.norm() : 0;
            }
            // The sum of areas as vectors is Newell's normal whatever the cut; their lengths add up to it where none is
            // outside. Places are floats, at most 4.2 sizes from the origin: 2.5e-7 sizes off the plane, so that a
            // triangle, of a perimeter below 7.2 sizes, leans by 1.8e-6 squares of it; 40 do by 7.2e-5, of 0.05 at
            // least.
            const double scale = normal.norm();
            EXPECT_LT((sum - normal).norm(), 1e-6 * scale);
            if (seed % 2 == 0) {
                EXPECT_NEAR(absolute, scale, 1.5e-3 * scale);
            }
            first += corners;
        }
        EXPECT_EQ(slot, triangles.size());
    }
}

TEST(Primitives, WhatMovesInPartsIsCutAsIfItWereNew) {
    const char* one = std::getenv("TESSERA_SEED");
    std::size_t changed = 0;
    for (std::uint64_t seed = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? seed : 100; seed <= last;
         ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_geometry --gtest_filter=Primitives.*");
        std::mt19937_64 random(seed);
        Scattered polygons = somePolygons(random, 0.05);
        const PrimitiveRuns before{
            .kind = RunKind::kPolygons, .positions = polygons.positions, .indices = {}, .lengths = polygons.lengths};
        Numbers assembled = *assembleRuns(before);
        const Numbers old = assembled;
        const std::size_t vertices = polygons.positions.size() / 3, first = random() % vertices,
                          end = first + 1 + random() % (vertices - first);
        for (std::size_t i = 3 * first; i < 3 * end; ++i)
            polygons.positions[i] *= 1 + 0.5F * static_cast<float>(random() % 100) / 100;
        const PrimitiveRuns after{
            .kind = RunKind::kPolygons, .positions = polygons.positions, .indices = {}, .lengths = polygons.lengths};
        const Expected<ByteRange> touched = reassembleRuns(after, first, end, assembled);
        ASSERT_TRUE(touched);
        EXPECT_EQ(assembled, *assembleRuns(after));
        for (std::size_t i = 0; i < old.size(); ++i)
            if (old[i] != assembled[i]) {
                ++changed;
                EXPECT_GE(i, touched->begin);
                EXPECT_LT(i, touched->end);
            }
    }
    EXPECT_TRUE(one || changed > 0) << "or nothing was tried";
}

}  // namespace
}  // namespace tessera
