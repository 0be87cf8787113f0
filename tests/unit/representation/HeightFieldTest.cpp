// Which meshes are height fields, and what a field keeps of them.
#include "server/collision/representation/HeightField.h"

#include <gtest/gtest.h>

#include "server/collision/representation/HeightFieldQueries.h"
#include "server/collision/tree/TriangleTree.h"
#include "tests/unit/representation/Terrains.h"

namespace tessera {
namespace {

using namespace terrains;

/// The same triangles with the same corners in the same order, and a pyramid that says of every block what is in it.
void expectSame(const HeightField& field, const TriangleMesh& mesh, const std::string& story) {
    ASSERT_EQ(field.faceCount(), mesh.faceCount()) << story;
    ASSERT_EQ(field.vertexCount(), mesh.vertexCount()) << story;
    EXPECT_EQ(field.bounds().lower, mesh.bounds().lower) << story;
    EXPECT_EQ(field.bounds().upper, mesh.bounds().upper) << story;
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        const Triangle is = field.triangle(face), was = mesh.triangle(face);
        for (std::size_t i = 0; i < 3; ++i) ASSERT_EQ(is[i], was[i]) << story << ", face " << face;
    }
    const int h = field.heightAxis();
    for (const HeightField::Level& level : field.levels()) {
        std::vector<HeightRange> truth(std::size_t{level.columns} * level.rows);
        for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
            const HeightField::Slot at = field.slotOf(face);
            ASSERT_EQ(field.faceOf(at.column, at.row, at.half), face) << story;
            for (const Vec3d& p : mesh.triangle(face))
                truth[at.row / level.cellRows * std::size_t{level.columns} + at.column / level.cellColumns].extend(
                    p[h]);
        }
        for (std::uint32_t block = 0; block < truth.size(); ++block) {
            ASSERT_EQ(field.range(level.start + block).low, truth[block].low) << story;
            ASSERT_EQ(field.range(level.start + block).high, truth[block].high) << story;
        }
    }
    EXPECT_EQ(field.levels().front().columns * field.levels().front().rows, 1u) << story;
}

TEST(HeightField, EveryOrderShapeAndAxisIsRecognised) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        Random random(seed);
        const Terrain terrain = anyTerrain(random);
        const TriangleMesh mesh = make(random, terrain).mesh();
        const Expected<HeightField> field = HeightField::recognise(mesh);
        const std::string story = "seed " + std::to_string(seed);
        ASSERT_TRUE(field) << story << ": " << field.error().message;
        expectSame(*field, mesh, story);
    }
}

TEST(HeightField, VerticesThatOnlyHolesWouldUseMayBeMissing) {
    Random random(5);
    const Grid grid = make(random, {.holes = 0.7});
    // As importers leave them: numbered as they are first used.
    std::vector<std::uint32_t> number(grid.positions.size() / 3, ~0U);
    Grid packed;
    for (const std::uint32_t vertex : grid.indices) {
        if (number[vertex] == ~0U) {
            number[vertex] = static_cast<std::uint32_t>(packed.positions.size() / 3);
            packed.positions.insert(packed.positions.end(), grid.positions.begin() + 3 * vertex,
                                    grid.positions.begin() + 3 * vertex + 3);
        }
        packed.indices.push_back(number[vertex]);
    }
    ASSERT_LT(packed.positions.size(), grid.positions.size());
    const Expected<HeightField> field = HeightField::recognise(packed.mesh());
    ASSERT_TRUE(field) << field.error().message;
    expectSame(*field, packed.mesh(), "packed");
}

TEST(HeightField, WhatIsNoneIsRefusedWithAReason) {
    const auto why = [](const Grid& grid) {
        const Expected<HeightField> field = HeightField::recognise(grid.mesh());
        return field ? std::string() : field.error().message;
    };
    Random random(1);
    for (const unsigned order : {0U, 4U, 8U}) {
        const Terrain hills{.height = [](double x, double y) { return 0.3 * std::sin(3 * x + y); },
                            .vertexOrder = order};
        const Grid good = make(random, hills);
        ASSERT_EQ(why(good), "");
        Grid moved = good;
        moved.positions[3 * 40] += 1e-6;
        EXPECT_NE(why(moved), "") << "a vertex off the grid";
        Grid twice = good;
        twice.indices.insert(twice.indices.end(), good.indices.begin(), good.indices.begin() + 3);
        EXPECT_EQ(why(twice), "triangles 0 and 176 lie on top of each other");
        Grid crossed = good;
        // A cell's triangles are 0 1 3 and 0 3 2.
        crossed.indices = {good.indices[0], good.indices[1], good.indices[2],
                           good.indices[1], good.indices[2], good.indices[5]};
        EXPECT_NE(why(crossed), "") << "a cell along both diagonals";
        Grid large = good;
        large.indices = {good.indices[0], good.indices[1], good.indices[6 * 11 + 2], 0, 1, 2};
        EXPECT_NE(why(large), "");
        Grid flat = good;
        flat.indices = {5, 5, 6};
        EXPECT_NE(why(flat), "");
    }
    Grid none;
    EXPECT_EQ(why(none), "no triangles");
    Grid above = make(random, {.columns = 3, .rows = 3});
    above.positions.insert(above.positions.end(), {above.positions[0], above.positions[1], 7.0});
    EXPECT_EQ(why(above), "vertices 0 and 9 are above each other");
    Grid soup;
    for (std::uint32_t i = 0; i < 300; ++i) {
        for (int k = 0; k < 3; ++k) soup.positions.push_back(between(random, -1, 1));
        soup.indices.push_back(i);
    }
    EXPECT_EQ(why(soup), "the vertices do not lie in rows and columns");
}

TEST(HeightField, TakesAFewBytesPerTriangle) {
    Random random(2);
    const Terrain hills{
        .columns = 257, .rows = 257, .height = [](double x, double y) { return 0.3 * std::sin(9 * x + 5 * y); }};
    const auto bytes = [&](Terrain terrain) {
        const TriangleMesh mesh = make(random, terrain).mesh();
        return static_cast<double>(HeightField::recognise(mesh)->memoryBytes()) / static_cast<double>(mesh.faceCount());
    };
    EXPECT_LT(bytes(hills), 2.4);
    const TriangleMesh mesh = make(random, hills).mesh();
    EXPECT_LT(30 * bytes(hills),
              static_cast<double>(TriangleTree(mesh).memoryBytes()) / static_cast<double>(mesh.faceCount()));
    Terrain other = hills;
    other.asFloats = false;
    EXPECT_LT(bytes(other), 4.4);
    other = hills;
    other.diagonals = 2;
    EXPECT_LT(bytes(other), 2.9);
    other = hills;
    other.vertexOrder = other.faceOrder = 8;
    EXPECT_LT(bytes(other), 12.5);
}

TEST(HeightField, RefitFollowsAPartAtThatPartsCost) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        Random random(seed);
        Terrain terrain = anyTerrain(random);
        terrain.columns += 40, terrain.rows += 30;
        Grid grid = make(random, terrain);
        Expected<HeightField> field = HeightField::recognise(grid.mesh());
        ASSERT_TRUE(field) << "seed " << seed;
        const std::size_t vertices = grid.positions.size() / 3;
        for (int step = 0; step < 4; ++step) {
            const std::size_t first = random() % vertices,
                              count = random() % std::min<std::size_t>(vertices - first + 1, 90);
            std::vector<Vec3d> now;
            for (std::size_t i = first; i < first + count; ++i) {
                double& height = grid.positions[3 * i + static_cast<std::size_t>(field->heightAxis())];
                height = between(random, -2, 2);
                if (step < 2 && terrain.asFloats) height = static_cast<double>(static_cast<float>(height));
                now.emplace_back(grid.positions[3 * i], grid.positions[3 * i + 1], grid.positions[3 * i + 2]);
            }
            const Expected<std::size_t> looks = field->refit(now, first);
            ASSERT_TRUE(looks) << "seed " << seed << ": " << looks.error().message;
            ASSERT_LE(*looks, 5 * 4 * count);
            expectSame(*field, grid.mesh(), "seed " + std::to_string(seed));
        }
    }
    Random random(3);
    const Terrain large{.columns = 1025, .rows = 1025};
    const Grid grid = make(random, large);
    HeightField field = *HeightField::recognise(grid.mesh());
    // A hundred vertices of a row touch the cells of two rows, and what is above them.
    std::vector<Vec3d> crater;
    for (std::size_t i = 500'000; i < 500'100; ++i)
        crater.emplace_back(grid.positions[3 * i], grid.positions[3 * i + 1], -0.5);
    EXPECT_LE(*field.refit(crater, 500'000), 60u);
}

TEST(HeightField, RefitRefusesWhatLeavesTheGrid) {
    Random random(4);
    const Grid grid = make(random, {});
    HeightField field = *HeightField::recognise(grid.mesh());
    const auto at = [&](std::size_t i) {
        return Vec3d(grid.positions[3 * i], grid.positions[3 * i + 1], grid.positions[3 * i + 2]);
    };
    const std::vector<Vec3d> aside{at(7) + Vec3d(0, 0, 1), at(8) + Vec3d(1e-9, 0, 0)};
    EXPECT_EQ(field.refit(aside, 7).error().code, ErrorCode::kRefused);
    EXPECT_EQ(field.refit(aside, 107).error().code, ErrorCode::kBadInput) << "beyond the last vertex";
    EXPECT_EQ(field.refit(std::vector<Vec3d>{at(7) + Vec3d(0, 0, 2e50)}, 7).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(field.refit(std::vector<Vec3d>{Vec3d(at(7).x(), at(7).y(), std::nan(""))}, 7).error().code,
              ErrorCode::kBadInput);
    expectSame(field, grid.mesh(), "after refusals");
}

}  // namespace
}  // namespace tessera
