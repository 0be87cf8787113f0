// Where textures are found, which of a glTF's images is shown, and images of other shapes in scene texts.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

constexpr const char* kPaintedTriangle =
    "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl paint\nf 1/1 2/2 3/3\n";

/// The first number of the image that an OBJ's material shows, whose file it names so; -1: none.
int shownBy(const Scratch& scratch, const std::string& name, std::vector<std::string>* notes = nullptr) {
    scratch.write("model/paint.mtl", "newmtl paint\nKd 1 1 1\nmap_Kd " + name + "\n");
    Expected<ImportedScene> scene =
        importScene(scratch.write("model/model.obj", kPaintedTriangle), kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    if (!scene) return -2;
    if (notes) *notes = scene->notes;
    const ImportedAspect aspect(std::move(*scene));
    const std::vector<const Image*> images = allOf<Image>(aspect);
    return images.empty() ? -1 : int{images[0]->pixels.as<std::uint8_t>()[0]};
}
std::string ofValue(std::uint8_t value) {
    return pictureOf({{value, value, value, 255}});
}

TEST(FoundTextures, ByTheirLastPartInAnyCaseBelowTheModelsFolder) {
    const Scratch scratch;
    scratch.write("model/textures/Wood.PNG", ofValue(7));
    std::vector<std::string> notes;
    for (const char* name : {"C:\\maps\\wood.png", "..\\..\\maps\\WOOD.png", "wood.PNG", "/home/somebody/wood.png",
                             "textures\\wood.png"}) {
        EXPECT_EQ(shownBy(scratch, name, &notes), 7) << name;
        EXPECT_WORDS(fmt::format("{}", fmt::join(notes, "\n"))) << name;
    }
    EXPECT_EQ(shownBy(scratch, "textures/Wood.PNG", &notes), 7);
    EXPECT_TRUE(notes.empty()) << "it stands where the file says";
    EXPECT_EQ(shownBy(scratch, "stone.png", &notes), -1);
    EXPECT_FALSE(notes.empty());
}

TEST(FoundTextures, TheOneWhoseFoldersAgreeAndElseTheNearest) {
    const Scratch scratch;
    scratch.write("model/a/deep/wood.png", ofValue(1));
    scratch.write("model/b/wood.png", ofValue(2));
    scratch.write("model/c/maps/wood.png", ofValue(3));
    EXPECT_EQ(shownBy(scratch, "D:\\job\\MAPS\\wood.png"), 3);
    EXPECT_EQ(shownBy(scratch, "D:\\job\\elsewhere\\wood.png"), 2);
}

TEST(FoundTextures, NothingOutsideOfTheModelsFolder) {
    const Scratch scratch;
    scratch.write("wood.png", ofValue(9));
    std::filesystem::create_directories(scratch.path("model/maps"));
    std::filesystem::create_symlink(scratch.path("wood.png"), scratch.path("model/maps/wood.png"));
    for (const char* name : {"../wood.png", "..\\wood.png", "wood.png", "maps/wood.png"})
        EXPECT_EQ(shownBy(scratch, name), -1) << name;
}

/// A texture of these sources, whose images are the files a.tga, b.ktx2, c.dds.
Expected<ImportedScene> texturedGltf(const Scratch& scratch, const std::string& texture, const std::string& more = "") {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3),
              coordinates = gltf.floats({0, 0, 1, 0, 0, 1}, "VEC2", 2);
    scratch.write("a.tga", ofValue(7));
    scratch.write("b.ktx2",
                  std::string("\xABKTX 20\xBB\r\n\x1A\n", 12) + std::string(32, '\0') + '\1' + std::string(100, '\0'));
    std::string dds(128, '\0');
    const auto put = [&dds](std::size_t at, const std::string& bytes) { dds.replace(at, bytes.size(), bytes); };
    put(0, "DDS ");
    dds[4] = 124, dds[12] = 4, dds[16] = 4, dds[80] = 4;
    put(84, "DXT1");
    scratch.write("c.dds", dds + std::string(8, '\x11'));
    const std::string rest = fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"TEXCOORD_0":{}}},"material":0}}]}}],
        "textures":[{}],"images":[{{"uri":"a.tga"}},{{"uri":"b.ktx2"}},{{"uri":"c.dds"}}]{})",
        positions, coordinates, texture, more);
    return importScene(scratch.write("model.gltf", gltf.text(rest)), kRootNode, importOptions());
}

TEST(GltfTextures, DdsComesBeforeTheOtherImage) {
    const Scratch scratch;
    Expected<ImportedScene> scene =
        texturedGltf(scratch, R"({"source":0,"extensions":{"MSFT_texture_dds":{"source":2}}})",
                     R"(,"extensionsUsed":["MSFT_texture_dds"])");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    ASSERT_EQ(allOf<Image>(aspect).size(), 1u);
    EXPECT_EQ(allOf<Image>(aspect)[0]->encoding, Image::kBc1);
}

TEST(GltfTextures, OfWhatIsNotReadTheOtherImageIsShown) {
    const Scratch scratch;
    const std::string required =
        R"(,"extensionsUsed":["KHR_texture_basisu"],"extensionsRequired":["KHR_texture_basisu"])";
    Expected<ImportedScene> scene =
        texturedGltf(scratch, R"({"source":0,"extensions":{"KHR_texture_basisu":{"source":1}}})", required);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_WORDS(notesIn(*scene));
    {
        const ImportedAspect aspect(std::move(*scene));
        ASSERT_EQ(allOf<Image>(aspect).size(), 1u);
        EXPECT_EQ(allOf<Image>(aspect)[0]->pixels.as<std::uint8_t>()[0], 7);
    }
    scene = texturedGltf(scratch, R"({"extensions":{"KHR_texture_basisu":{"source":1}}})", required);
    ASSERT_TRUE(scene) << messageOf(scene) << ": the rest is there all the same";
    EXPECT_WORDS(notesIn(*scene));
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_TRUE(allOf<Image>(aspect).empty());
    EXPECT_EQ(allOf<Geometry>(aspect).size(), 1u);
}

/// A scene whose surroundings are the image: images that nothing shows are left out.
Expected<ImportedScene> withImage(const Scratch& scratch, const std::string& image, bool surroundings = true) {
    const std::string use = surroundings ? "node { environment { image: \"i\" } }"
                                         : "material { name: \"m\" base_color_image: \"i\" } node { material: \"m\" "
                                           "box { size { x: 1 y: 1 z: 1 } } }";
    return importScene(scratch.write("scene.tsct", "image { name: \"i\" " + image + " }\n" + use + "\n"), kRootNode,
                       importOptions());
}

TEST(ImageShapes, ACubeIsSixFilesOrOneOfSixBelowEachOther) {
    const Scratch scratch;
    for (int i = 0; i < 6; ++i) scratch.write(fmt::format("{}.tga", i), ofValue(static_cast<std::uint8_t>(10 * i)));
    std::string below("\0\0\2\0\0\0\0\0\0\0\0\0\1\0\6\0\40\50", 18);
    for (int i = 0; i < 6; ++i) below += std::string(3, static_cast<char>(10 * i)) + '\xff';
    scratch.write("below.tga", below);
    for (const std::string& said : {std::string(R"(face: ["0.tga", "1.tga", "2.tga", "3.tga", "4.tga", "5.tga"])"),
                                    std::string(R"(uri: "below.tga" shape: CUBE)")}) {
        Expected<ImportedScene> scene = withImage(scratch, said);
        ASSERT_TRUE(scene) << messageOf(scene);
        const ImportedAspect aspect(std::move(*scene));
        ASSERT_EQ(allOf<Image>(aspect).size(), 1u);
        const Image& cube = *allOf<Image>(aspect)[0];
        EXPECT_EQ(cube.shape, Image::kCube);
        EXPECT_EQ(cube.widthPx, 1);
        EXPECT_EQ(cube.heightPx, 1);
        ASSERT_EQ(cube.pixels.sizeBytes(), 24u);
        for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(cube.pixels.as<std::uint8_t>()[4 * i], 10 * i);
    }
}

TEST(ImageShapes, ASolidIsCutAndALineIsOneRow) {
    const Scratch scratch;
    std::string below("\0\0\2\0\0\0\0\0\0\0\0\0\1\0\6\0\40\50", 18);
    below += std::string(24, '\x20');
    scratch.write("below.tga", below);
    scratch.write("row.tga", pictureOf({{1, 2, 3, 4}, {5, 6, 7, 8}}));
    Expected<ImportedScene> solid =
        withImage(scratch, R"(uri: "below.tga" shape: SOLID depth_px: 3 wrap_w: MIRROR)", false);
    ASSERT_TRUE(solid) << messageOf(solid);
    const ImportedAspect aspect(std::move(*solid));
    const Image& image = *allOf<Image>(aspect).at(0);
    EXPECT_EQ(image.shape, Image::kSolid);
    EXPECT_EQ(image.depthPx, 3);
    EXPECT_EQ(image.heightPx, 2);
    EXPECT_EQ(image.wrapW, Image::kMirror);
    Expected<ImportedScene> line = withImage(scratch, R"(uri: "row.tga" shape: LINE)", false);
    ASSERT_TRUE(line) << messageOf(line);
    EXPECT_EQ(allOf<Image>(ImportedAspect(std::move(*line))).at(0)->shape, Image::kLine);
}

TEST(SceneTextures, ThatCannotBeHadAreNamedWithTheirPlaceAndTheRestIsThere) {
    const Scratch scratch;
    scratch.write("one.tga", ofValue(1));
    scratch.write("broken.png", "\x89PNG\r\n\x1a\n and then nothing");
    scratch.write("sea.tsct", R"(image { name: "there" uri: "one.tga" }
image { name: "gone" uri: "nowhere.png" }
  image { name: "broken" uri: "broken.png" }
image { name: "face" face: ["one.tga", "one.tga", "one.tga", "lost.tga", "one.tga", "one.tga"] }
image { name: "screen" uri: "still.png" }
material { name: "m" base_color_image: "gone" normal_image: "there" layer { image: "broken" }
  layer { image: "there" mode: DECAL }
  uniform { name: "a" image: "gone" } uniform { name: "b" value: 3 } }
material { name: "film" base_color_image: "screen" }
node { name: "box" material: "m" box { size { x: 1 y: 1 z: 1 } } }
node { name: "wall" material: "film" box { size { x: 1 y: 1 z: 1 } } }
node { environment { image: "face" } }
node { movie { image: "screen" file: "film.avi" } })");
    Expected<ImportedScene> scene = importScene(scratch.path("sea.tsct"), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const std::string path = scratch.path("sea.tsct");
    const std::vector<std::string> faults = scene->faults;
    ASSERT_EQ(faults.size(), 4u);
    EXPECT_EQ(faults[0], path +
                             ":2:1: the image 'gone' cannot be had: 'nowhere.png': No such file or directory; what "
                             "names it is drawn without");
    EXPECT_TRUE(faults[1].starts_with(path + ":3:3: the image 'broken' cannot be had: 'broken.png': ")) << faults[1];
    EXPECT_TRUE(faults[2].starts_with(path + ":4:1: the image 'face' cannot be had: 'lost.tga': ")) << faults[2];
    EXPECT_TRUE(faults[3].starts_with(path + ":5:1: the image 'screen' cannot be had: ")) << faults[3];
    for (const std::string& fault : faults) EXPECT_NE(std::ranges::find(scene->notes, fault), scene->notes.end());
    const ImportedAspect aspect(std::move(*scene));
    const Material& look = *aspect->get<Material>(aspect.core<Geometry>("/box")->material);
    EXPECT_FALSE(look.baseColorImage);
    EXPECT_TRUE(look.normalImage);
    ASSERT_EQ(look.layers.size(), 1u);
    EXPECT_EQ(aspect->get<TextureLayer>(look.layers[0])->mode, TextureLayer::kDecal);
    ASSERT_EQ(look.uniforms.size(), 1u);
    EXPECT_EQ(aspect->get<Uniform>(look.uniforms[0])->name, "b");
    // What a film is shown in is there, black, until the film is.
    const Material& film = *aspect->get<Material>(aspect.core<Geometry>("/wall")->material);
    ASSERT_TRUE(film.baseColorImage);
    EXPECT_EQ(aspect->get<Image>(film.baseColorImage)->widthPx, 1);
    ASSERT_EQ(allOf<Environment>(aspect).size(), 1u);
    EXPECT_FALSE(allOf<Environment>(aspect)[0]->image);
}

TEST(SceneTextures, OutsideOfTheScenesFolderAreRefused) {
    const Scratch scratch;
    const std::string refusal = messageOf(withImage(scratch, "uri: \"../../etc/passwd\""));
    EXPECT_WORDS(refusal);
}

TEST(ImageShapes, WhatTheTextMayNotSayIsRefusedInWords) {
    const Scratch scratch;
    scratch.write("one.tga", ofValue(1));
    const auto refusal = [&](const std::string& said) { return messageOf(withImage(scratch, said)); };
    EXPECT_WORDS(refusal(R"(face: ["one.tga", "one.tga"])"));
    EXPECT_WORDS(refusal(R"(face: ["one.tga", "one.tga", "../one.tga", "one.tga", "one.tga", "one.tga"])"));
}

TEST(ImageShapes, APictureOfAnotherShapeCostsItselfAlone) {
    const Scratch scratch;
    scratch.write("one.tga", ofValue(1));
    scratch.write("two.tga", pictureOf({{1, 2, 3, 4}, {5, 6, 7, 8}}));
    const std::string uses[] = {"node { environment { image: \"i\" } }",
                                "material { name: \"m\" base_color_image: \"i\" }\n"};
    const char* const wrong[] = {R"(face: ["one.tga", "one.tga", "two.tga", "one.tga", "one.tga", "one.tga"])",
                                 R"(face: ["two.tga", "two.tga", "two.tga", "two.tga", "two.tga", "two.tga"])",
                                 R"(uri: "two.tga" shape: CUBE)",
                                 R"(uri: "two.tga" shape: SOLID depth_px: 2)",
                                 "",
                                 "shape: CUBE"};
    for (const std::string& use : uses)
        for (const char* const said : wrong) {
            const std::string path = scratch.write(
                "scene.tsct", "\n image { name: \"i\" " + std::string(said) + " }\n" + use +
                                  "node { name: \"box\" material: \"m\" box { size { x: 1 y: 1 z: 1 } } }\n" +
                                  (use.starts_with("node") ? "material { name: \"m\" }" : ""));
            Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
            ASSERT_TRUE(scene) << messageOf(scene);
            ASSERT_EQ(scene->faults.size(), 1u) << said;
            EXPECT_TRUE(scene->faults[0].starts_with(path + ":2:2: ")) << scene->faults[0];
            EXPECT_WORDS(scene->faults[0]);
            EXPECT_EQ(std::ranges::count(scene->notes, scene->faults[0]), 1);
            const ImportedAspect aspect(std::move(*scene));
            EXPECT_TRUE(allOf<Image>(aspect).empty()) << said;
            EXPECT_FALSE(aspect->get<Material>(aspect.core<Geometry>("/box")->material)->baseColorImage);
            for (const Environment* environment : allOf<Environment>(aspect)) EXPECT_FALSE(environment->image);
        }
}

TEST(ImageShapes, SurroundingsOfAnotherShapeAreShownWithoutTheirPicture) {
    const Scratch scratch;
    scratch.write("one.tga", ofValue(1));
    // What lies all around cannot be a row, or a square; a surface can have either.
    const std::pair<const char*, const char*> wrong[] = {
        {R"(uri: "one.tga" shape: LINE)", "it is neither flat nor a cube"},
        {R"(uri: "one.tga")", "1 × 1 pixels are not about twice as wide as high"}};
    for (const auto& [said, why] : wrong) {
        const std::string image = std::string("image { name: \"i\" ") + said + " }\n";
        const std::string path =
            scratch.write("scene.tsct", image + "material { name: \"m\" base_color_image: \"i\" }\n" +
                                            "node { repeat { count: 3 } node { environment { image: \"i\" } } }\n" +
                                            "node { name: \"box\" material: \"m\" box { size { x: 1 y: 1 z: 1 } } }\n");
        Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        ASSERT_EQ(scene->faults.size(), 1u) << said;
        EXPECT_EQ(scene->faults[0],
                  path + ":3:35: the surroundings' image 'i' cannot be had: " + why + "; they are shown without");
        const ImportedAspect aspect(std::move(*scene));
        EXPECT_TRUE(aspect->get<Material>(aspect.core<Geometry>("/box")->material)->baseColorImage);
        EXPECT_EQ(allOf<Environment>(aspect).size(), 3u);
        for (const Environment* environment : allOf<Environment>(aspect)) EXPECT_FALSE(environment->image);
    }
}

}  // namespace
}  // namespace tessera
