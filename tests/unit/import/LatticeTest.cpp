// What authors write of lattices that bend shapes and meshes.
#include <fmt/format.h>

#include "common/cores/Deformation.h"
#include "common/cores/Material.h"
#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importedLattice(const std::string& text) {
    const Scratch scratch;
    return importScene(scratch.write("bent.tsct", text), kRootNode, importOptions());
}

TEST(Lattices, BendTheShapeOfTheirNodeEachByItself) {
    std::string points;
    for (const int z : {-1, 1})
        for (const int y : {-1, 3})
            for (const int x : {-1, 1}) points += fmt::format("point {{ x: {} y: {} z: {} }} ", x, y, z);
    Expected<ImportedScene> scene = importedLattice(
        "material { name: \"red\" base_color { r: 1 } }\n"
        "node { name: \"bent\" box { size { x: 2 y: 2 z: 2 } } material: \"red\" lattice { points_x: 2 points_y: 2 "
        "points_z: 2 " +
        points +
        "} }\n"
        "node { name: \"rest\" repeat { count: 2 step { x: 5 } } sphere { radius: 2 } lattice { points_y: 7 } }\n");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    EXPECT_GT(scene->triangles, 12u);
    const ImportedAspect aspect(std::move(*scene));
    const auto* bent = aspect.core<Deformation>("/bent");
    ASSERT_NE(bent, nullptr);
    EXPECT_EQ(bent->degreeY, 1);
    EXPECT_EQ(bent->lower, Vec3d(-1, -1, -1));
    EXPECT_NE(aspect->get<Material>(bent->material), nullptr);
    const Box box = drawableOf(Object::of(*bent)).bounds();
    EXPECT_NEAR(box.upper.y(), 3, 1e-6);
    EXPECT_NEAR(box.upper.x(), 1, 1e-6);
    std::size_t others = 0;
    for (const ObjectId id : aspect->ids())
        if (const auto* rest = aspect->get<Deformation>(id); rest && rest != bent) {
            ++others;
            // At rest, and there to be moved.
            EXPECT_EQ(rest->controlPoints.sizeBytes(), 4u * 7u * 4u * 12u);
            EXPECT_NEAR(drawableOf(Object::of(*rest)).bounds().upper.y(), 2, 1e-5);
            EXPECT_EQ(rest->pointsY, 7);
            EXPECT_EQ(rest->degreeY, 3);
        }
    EXPECT_EQ(others, 2u);
}

TEST(Lattices, ThatCannotBeAreRefusedByName) {
    const auto why = [](const std::string& node) {
        return messageOf(importedLattice("node { name: \"n\" " + node + " }"));
    };
    EXPECT_WORDS(why("lattice {}"));
    EXPECT_WORDS(why("point_light {} lattice {}"));
    EXPECT_WORDS(why("points { point { x: 1 } radius: 1 } lattice {}"));
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { points_x: 1 }"));
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { points_x: 4000000000 }"));
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { degree_z: 11 points_z: 20 }"));
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { point { x: 1 } }"));
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { lower { x: 5 } }"));
    EXPECT_NE(why("sphere { radius: 1 } lattice { lower { x: -1e31 y: -1 z: -1 } }").size(), 0u);
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { points_x: 2 points_y: 2 points_z: 2" + [] {
        std::string p;
        for (int i = 0; i < 8; ++i) p += " point { x: 1e39 }";
        return p;
    }() + " }"));
    EXPECT_WORDS(why("sphere { radius: 1 } lattice { lower { x: nan } }"));
}

}  // namespace
}  // namespace tessera
