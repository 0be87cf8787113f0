// Subdivision surfaces that authors write.
#include <fmt/format.h>

#include "common/cores/Material.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kCube =
    "points: [-1,-1,-1, 1,-1,-1, 1,1,-1, -1,1,-1, -1,-1,1, 1,-1,1, 1,1,1, -1,1,1] "
    "face_vertices: [0,3,2,1, 4,5,6,7, 0,1,5,4, 2,3,7,6, 1,2,6,5, 0,4,7,3] ";

Expected<ImportedScene> importedSurface(const std::string& fields) {
    const Scratch scratch;
    return importScene(scratch.write("surface.tsct",
                                     "material { name: \"red\" }\nnode { name: \"top\" material: \"red\"\n  node { "
                                     "name: \"skin\" subdivision_surface { " +
                                         fields + " } } }\n"),
                       kRootNode, importOptions());
}

TEST(SubdivisionText, SaysAllThatTheCoreHolds) {
    Expected<ImportedScene> scene =
        importedSurface(kCube +
                        "creases: [4,5, 5,6] crease_sharpness: [2.5, 10] corners: [0] corner_sharpness: [3] holes: [1] "
                        "boundary: EDGE_AND_CORNER crease_method: CHAIKIN triangles: SMOOTH level: 2");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    EXPECT_EQ(scene->geometries, 1u);
    EXPECT_EQ(scene->triangles, 5u * 2 * 16);
    const ImportedAspect aspect(std::move(*scene));
    const SubdivisionSurface* found = nullptr;
    for (const ObjectId id : aspect->ids())
        if (const auto* surface = aspect->get<SubdivisionSurface>(id)) found = surface;
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->points.sizeBytes(), 8u * 12);
    EXPECT_EQ(found->faceSizes.as<std::uint32_t>().size(), 6u) << "absent: quadrilaterals";
    EXPECT_EQ(found->creases.as<std::uint32_t>()[3], 6u);
    EXPECT_EQ(found->creaseSharpness.as<float>()[0], 2.5f);
    EXPECT_EQ(found->corners.as<std::uint32_t>()[0], 0u);
    EXPECT_EQ(found->cornerSharpness.as<float>()[0], 3);
    EXPECT_EQ(found->holes.as<std::uint32_t>()[0], 1u);
    EXPECT_EQ(found->boundary, SubdivisionSurface::kEdgeAndCorner);
    EXPECT_EQ(found->creaseMethod, SubdivisionSurface::kChaikin);
    EXPECT_EQ(found->triangles, SubdivisionSurface::kSmooth);
    EXPECT_EQ(found->level, 2);
    EXPECT_TRUE(aspect->get<Material>(found->material));
}

TEST(SubdivisionText, HasDefaultsAndOtherSchemes) {
    Expected<ImportedScene> scene = importedSurface(
        "scheme: LOOP points: [0,0,0, 1,0,0, 0,1,0, 0,0,1] face_vertices: [0,2,1, 0,1,3, 1,2,3, 2,0,3]");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 4u * 64) << "level 3";
    scene = importedSurface(kCube + "scheme: BILINEAR level: 0");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 12u);
}

TEST(SubdivisionText, IsRefusedWithFileLineAndColumn) {
    for (const std::string& fields : std::initializer_list<std::string>{
             "points: [0,0,0] face_vertices: [0,1,2,3]",
             "points: [0,0] face_vertices: [0]",
             kCube + "face_sizes: [4,4]",
             kCube + "creases: [0,6]",
             kCube + "level: 7",
             kCube + "material: \"blue\"",
             "points: [nan,0,0] face_vertices: []",
         }) {
        const Expected<ImportedScene> scene = importedSurface(fields);
        ASSERT_FALSE(scene) << fields;
        EXPECT_WORDS(scene.error().message);
    }
}

TEST(SubdivisionText, EqualSurfacesAreOneCore) {
    const Scratch scratch;
    Expected<ImportedScene> scene =
        importScene(scratch.write("twins.tsct",
                                  fmt::format("definition {{ name: \"cube\" node {{ subdivision_surface {{ {} }} }} "
                                              "}}\nnode {{ repeat {{ count: 5 step {{ x: 3 }} }} instance: \"cube\" }}",
                                              kCube)),
                    kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 1u);
    EXPECT_EQ(scene->triangles, 5u * 6 * 128);
    EXPECT_EQ(scene->trianglesStored, 6u * 128);
}

/// What is saved is its control points, and comes back with a check.
TEST(SubdivisionText, IsSavedAndReadBack) {
    Expected<ImportedScene> scene = importedSurface(kCube + "creases: [4,5] level: 1");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const Scratch scratch;
    for (const char* name : {"back.tsct", "back.tsc"}) {
        const std::string path = scratch.path(name);
        ASSERT_TRUE(saveScene(path, *aspect));
        Expected<ImportedScene> back = importScene(path, kRootNode, importOptions());
        ASSERT_TRUE(back) << messageOf(back);
        EXPECT_EQ(back->geometries, 1u);
        EXPECT_EQ(back->trianglesStored, 6u * 8);
    }
}

}  // namespace
}  // namespace tessera
