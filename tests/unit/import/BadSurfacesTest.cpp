/// Control meshes and NURBS that nobody would draw: each has a surface of finite numbers, or is refused by name.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "common/cores/NurbsSurface.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importedNode(const std::string& shape) {
    const Scratch scratch;
    return importScene(scratch.write("bad.tsct", "node { name: \"n\" " + shape + " }\n"), kRootNode, importOptions());
}

/// Its triangles; all that is drawn is numbers. Nothing where it is refused.
std::optional<std::size_t> finiteTriangles(const std::string& shape, std::size_t surfaces = 1) {
    Expected<ImportedScene> scene = importedNode(shape);
    EXPECT_TRUE(scene) << messageOf(scene) << "\n" << shape;
    if (!scene) return {};
    const std::size_t triangles = scene->triangles;
    const ImportedAspect aspect(std::move(*scene));
    std::size_t drawn = 0;
    for (const ObjectId id : aspect->ids()) {
        const Object object = aspect->find(id);
        if (!object.as<SubdivisionSurface>() && !object.as<NurbsSurfaceCore>()) continue;
        ++drawn;
        const MeshArrays& arrays = drawableOf(object).arrays();
        for (const Blob* blob : {&arrays.positions, &arrays.normals})
            for (const float number : blob->as<float>()) EXPECT_TRUE(std::isfinite(number)) << shape;
    }
    EXPECT_EQ(drawn, surfaces);
    return triangles;
}

void isRefusedInWords(const std::string& shape) {
    const Expected<ImportedScene> scene = importedNode(shape);
    ASSERT_FALSE(scene) << shape;
    EXPECT_WORDS(scene.error().message);
}

std::string controlMesh(const std::string& points, const std::string& sizes, const std::string& vertices,
                        const std::string& more = "") {
    return fmt::format("subdivision_surface {{ points: [{}] face_sizes: [{}] face_vertices: [{}] {} }}", points, sizes,
                       vertices, more);
}

/// A pole and triangles around it.
std::string fan(int valence, const std::string& more) {
    std::string points = "0, 0, 1", sizes, vertices;
    for (int i = 0; i < valence; ++i) {
        const double angle = 2 * std::numbers::pi * i / valence;
        points += fmt::format(", {}, {}, 0", std::cos(angle), std::sin(angle));
        sizes += i ? ", 3" : "3";
        vertices += fmt::format("{}0, {}, {}", i ? ", " : "", 1 + i, 1 + (i + 1) % valence);
    }
    return controlMesh(points, sizes, vertices, more);
}

TEST(BadSurfaces, PolesOfAnyValenceAreDrawn) {
    std::string poles;
    std::size_t count = 0, triangles = 0;
    for (int valence = 3; valence <= 60; ++valence)
        for (const bool loop : {false, true}) {
            poles += "node { " + fan(valence, loop ? "scheme: LOOP level: 2" : "level: 2") + " } ";
            ++count;
            // Of Loop's each triangle is 16; of the other scheme each is three quadrilaterals of 4 by 2 triangles.
            triangles += static_cast<std::size_t>(valence) * (loop ? 16 : 24);
        }
    EXPECT_EQ(finiteTriangles(poles, count), triangles);
}

/// Each vertex near a pole depends on all its spokes: weights grow with the square of these.
TEST(BadSurfaces, FansOfManySpokesAreDrawnAndOfMoreThanThereMayBeRefused) {
    EXPECT_EQ(finiteTriangles(fan(300, "scheme: LOOP level: 1")), 1200u);
    EXPECT_EQ(finiteTriangles(fan(300, "level: 1")), 1800u);
    isRefusedInWords(fan(4097, "level: 0"));
}

TEST(BadSurfaces, WithoutAreaTheyAreDrawnAsNothing) {
    EXPECT_EQ(finiteTriangles(controlMesh("1,1,1, 1,1,1, 1,1,1, 1,1,1", "4", "0,1,2,3")), 128u) << "a point";
    EXPECT_EQ(finiteTriangles(controlMesh("0,0,0, 1,0,0, 2,0,0, 3,0,0", "4", "0,1,2,3")), 128u) << "a line";
    EXPECT_EQ(finiteTriangles(controlMesh("0,0,0, 1,0,0, 1,1,0, 0,1,0", "4", "0,1,1,3")), 128u)
        << "a corner named twice";
    EXPECT_EQ(
        finiteTriangles("nurbs_surface { degree_u: 1 degree_v: 1 count_u: 2 point {} point {} point {} point {} }"),
        0u);
}

TEST(BadSurfaces, OpenAndNonManifoldMeshesAreDrawn) {
    EXPECT_EQ(finiteTriangles(controlMesh("0,0,0, 0,1,0, 1,0,0, 1,1,0, -1,0,0, -1,1,0, 0,0,1, 0,1,1", "4,4,4",
                                          "0,2,3,1, 0,1,5,4, 0,1,7,6")),
              384u)
        << "an edge of three faces";
    EXPECT_EQ(
        finiteTriangles(controlMesh("0,0,0, 1,0,0, 1,1,0, 0,1,0, -1,0,0, -1,-1,0, 0,-1,0", "4,4", "0,1,2,3, 0,4,5,6")),
        256u)
        << "faces that share a corner alone";
    EXPECT_EQ(finiteTriangles(controlMesh("0,0,0, 0,1,0, 1,0,0, 1,1,0, -1,0,0, -1,1,0", "4,4", "0,2,3,1, 0,4,5,1")),
              256u)
        << "neighbours that are wound against each other";
}

TEST(BadSurfaces, CreasesThatEndNowhereAreDartsAndThoseAlongNothingAreRefused) {
    std::string points, sizes, vertices;
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 5; ++x) points += fmt::format("{}{}, {}, {}", x + y ? ", " : "", x, y, (x * y) % 3);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            const int first = 5 * y + x;
            sizes += x + y ? ", 4" : "4";
            vertices += fmt::format("{}{}, {}, {}, {}", x + y ? ", " : "", first, first + 1, first + 6, first + 5);
        }
    EXPECT_EQ(finiteTriangles(controlMesh(points, sizes, vertices, "creases: [6, 7]")), 2048u)
        << "both its ends are inside";
    EXPECT_EQ(
        finiteTriangles(controlMesh(points, sizes, vertices, "creases: [6, 7, 12, 13] crease_sharpness: [0.3, 10]")),
        2048u);
    isRefusedInWords(controlMesh(points, sizes, vertices, "creases: [6, 8]"));
    isRefusedInWords(controlMesh(points, sizes, vertices, "creases: [6, 6]"));
}

/// One row of a curve of degree 3 drawn out, with one knot inside, so many times.
std::string drawnOut(int times) {
    std::string knots = "0,0,0,0", points;
    for (int i = 0; i < times; ++i) knots += ",1";
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 4 + times; ++x) points += fmt::format("point {{ x: {} y: {} z: {} }} ", x, y, x * x % 3);
    return fmt::format("nurbs_surface {{ degree_u: 3 degree_v: 1 count_u: {} knot_u: [{},2,2,2,2] {} }}", 4 + times,
                       knots, points);
}

TEST(BadSurfaces, KnotsOfFullMultiplicityTearTheSurfaceAndMoreAreRefused) {
    for (int times = 0; times <= 4; ++times) EXPECT_GT(finiteTriangles(drawnOut(times)).value_or(0), 0u) << times;
    isRefusedInWords(drawnOut(5));
}

std::string trimmed(const std::string& loops) {
    return "nurbs_surface { degree_u: 1 degree_v: 1 count_u: 2 point {} point { x: 1 } point { y: 1 } point { x: 1 y: "
           "1 } " +
           loops + " }";
}
std::string trim(bool hole, std::initializer_list<std::pair<double, double>> corners) {
    std::string points;
    for (const auto& [u, v] : corners) points += fmt::format("point {{ x: {} y: {} }} ", u, v);
    return fmt::format("loop {{ {} curve {{ degree: 1 {} }} }} ", hole ? "hole: true" : "", points);
}

TEST(BadSurfaces, TrimsThatCrossOrAreNoLoopsAreRefused) {
    const std::string low = trim(true, {{.2, .2}, {.6, .2}, {.6, .6}, {.2, .6}, {.2, .2}});
    EXPECT_GT(finiteTriangles(trimmed(low)).value_or(0), 2u);
    isRefusedInWords(trimmed(low + trim(true, {{.4, .4}, {.8, .4}, {.8, .8}, {.4, .8}, {.4, .4}})));
    isRefusedInWords(trimmed(trim(false, {{.2, .2}, {.8, .8}, {.8, .2}, {.2, .8}, {.2, .2}})));
    isRefusedInWords(trimmed(trim(true, {{.2, .2}, {.6, .2}, {.6, .6}})));
    isRefusedInWords(trimmed(trim(true, {{.2, .2}, {1.6, .2}, {1.6, .6}, {.2, .6}, {.2, .2}})));
}

}  // namespace
}  // namespace tessera
