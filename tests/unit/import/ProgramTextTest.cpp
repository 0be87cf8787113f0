// Programs, passes, edges and coarser materials as authors write them, and as they are saved.
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/scenefile/SceneFile.h"
#include "tests/support/SceneStructure.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

constexpr const char* kProgrammed = R"(
    image { name: "a" uri: "a.tga" }
    material { name: "m" fill: EDGES line_width: 2.5 point_size: 7 pass: "over" pass: "third" coarser: "over"
      coarser_below: 40
               program { surface: "uniform vec3 tint;\n" "void surface(inout Surface s) {}" vertex: "" reach: 0.5 }
               uniform { name: "tint" value: [1, 0.5] } uniform { name: "map" image: "a" } }
    material { name: "over" fill: CORNERS coarser: "m" }
    material { name: "third" fill: EDGES }
    node { name: "n" material: "m" box { size { x: 1 y: 1 z: 1 } } })";

Expected<ImportedScene> importProgrammed(const std::string& text) {
    const Scratch scratch;
    scratch.write("a.tga", pictureOf({{255, 0, 0, 255}, {0, 255, 0, 0}}));
    return importScene(scratch.write("scene.tsct", text), kRootNode, importOptions());
}

TEST(ProgramText, SaysProgramsPassesEdgesAndCoarserOnes) {
    Expected<ImportedScene> scene = importProgrammed(kProgrammed);
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* geometry = aspect.core<Geometry>("/n");
    ASSERT_NE(geometry, nullptr);
    const auto* m = aspect->get<Material>(geometry->material);
    ASSERT_NE(m, nullptr);
    EXPECT_EQ(m->fill, Material::kEdges);
    EXPECT_EQ(m->lineWidth, 2.5f);
    EXPECT_EQ(m->pointSize, 7);
    EXPECT_EQ(m->coarserBelow, 40);
    ASSERT_EQ(m->passes.size(), 2u);
    EXPECT_EQ(aspect->get<Material>(m->passes[1])->fill, Material::kEdges) << "by its name";
    EXPECT_EQ(m->passes[0], m->coarser);
    const auto* over = aspect->get<Material>(m->coarser);
    ASSERT_NE(over, nullptr);
    EXPECT_EQ(over->fill, Material::kCorners);
    EXPECT_EQ(over->coarser, geometry->material) << "in a circle";
    const auto* program = aspect->get<SurfaceProgram>(m->program);
    ASSERT_NE(program, nullptr);
    EXPECT_EQ(program->surface, "uniform vec3 tint;\nvoid surface(inout Surface s) {}");
    EXPECT_EQ(program->reach, 0.5);
    EXPECT_EQ(program->verdict, SurfaceProgram::kUntried);
    ASSERT_EQ(m->uniforms.size(), 2u);
    const auto* tint = aspect->get<Uniform>(m->uniforms[0]);
    const auto* map = aspect->get<Uniform>(m->uniforms[1]);
    ASSERT_TRUE(tint && map);
    EXPECT_EQ(tint->value, Vec4f(1, 0.5f, 0, 0));
    EXPECT_NE(aspect->get<Image>(map->image), nullptr);
}

TEST(ProgramText, SavedAndReadBackIsTheSame) {
    Expected<ImportedScene> scene = importProgrammed(kProgrammed);
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const Scratch scratch;
    const Expected<void> saved = saveScene(scratch.path("saved.tsct"), *aspect);
    ASSERT_TRUE(saved) << saved.error().message;
    Expected<ImportedScene> back = importScene(scratch.path("saved.tsct"), kRootNode, importOptions());
    ASSERT_TRUE(back) << messageOf(back);
    const ImportedAspect again(std::move(*back));
    EXPECT_EQ(structureDifference(*aspect, *again), "");
}

TEST(ProgramText, WhatIsWrongIsSaid) {
    const char* const wrong[] = {
        "pass: \"none\"",
        "coarser: \"none\"",
        "pass: \"m\" pass: \"m\" pass: \"m\" pass: \"m\" pass: \"m\"",
        "pass: \"m\"",
        "line_width: nan",
        "fill: DOTS",
        "program { reach: -1 }",
        "uniform { name: \"x\" value: [1, 2, 3, 4, 5] }",
        "uniform { name: \"x\" value: nan }",
        "uniform { name: \"x\" image: \"none\" }",
    };
    for (const std::string text : wrong) {
        const Expected<ImportedScene> scene = importProgrammed(
            "material { name: \"m\" " + text + " }\nnode { material: \"m\" box { size { x: 1 y: 1 z: 1 } } }");
        ASSERT_FALSE(scene) << text;
        EXPECT_WORDS(scene.error().message);
    }
    // As long as the list of materials is, and no stack: named in words.
    std::string chain;
    for (int i = 0; i < 100; ++i)
        chain += "material { name: \"m" + std::to_string(i) + "\" coarser: \"m" + std::to_string(i + 1) + "\" }\n";
    const Expected<ImportedScene> scene = importProgrammed(
        chain + "material { name: \"m100\" }\nnode { material: \"m0\" box { size { x: 1 y: 1 z: 1 } } }");
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

}  // namespace
}  // namespace tessera
