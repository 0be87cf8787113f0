/// Numbers of materials that are out of their bounds: files are shown with the nearest good ones, and say so.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>

#include "common/cores/Material.h"
#include "common/scenefile/SceneFile.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

struct Numbered {
    std::string path;  ///< gone
    std::vector<std::string> notes, mended, faults;
    std::optional<Material> material;
    std::string error;
    [[nodiscard]] std::string all() const { return fmt::format("{}{}", error, fmt::join(notes, "\n")); }
};
Numbered numbered(const std::string& name, const std::string& bytes,
                  const std::vector<std::pair<std::string, std::string>>& beside = {}) {
    const Scratch scratch;
    for (const auto& [file, text] : beside) scratch.write(file, text);
    Numbered shown{.path = scratch.write(name, bytes)};
    Expected<ImportedScene> scene = importScene(shown.path, kRootNode, importOptions());
    if (!scene) {
        shown.error = messageOf(scene);
        return shown;
    }
    shown.notes = scene->notes, shown.mended = scene->mended, shown.faults = scene->faults;
    const ImportedAspect aspect(std::move(*scene));
    for (const Material* material : allOf<Material>(aspect)) shown.material = *material;
    return shown;
}

constexpr const char* kBox = "node { name: \"box\" material: \"m\" box { size { x: 1 y: 1 z: 1 } } }\n";

TEST(NumbersOfMaterials, OutOfTheirBoundsAreNamedByTheirPlaceInAScenesText) {
    const Numbered shown = numbered("a.tsct",
                                    "material { name: \"m\"\n  base_color { r: 2 g: 0.5 b: -1 a: 7 }\n  metallic: "
                                    "-0.25 roughness: 9\n  ior: 0.5 }\n" +
                                        std::string(kBox));
    ASSERT_TRUE(shown.material) << shown.all();
    EXPECT_EQ(shown.material->baseColor, Vec4f(1, 0.5f, 0, 1));
    EXPECT_EQ(shown.material->metallic, 0.0f);
    EXPECT_EQ(shown.material->roughness, 1.0f);
    EXPECT_EQ(shown.material->ior, 1.0f);
    for (const std::string& note : shown.notes) EXPECT_WORDS(note);
    EXPECT_EQ(shown.mended, shown.notes) << "whoever checks it, is told";
    EXPECT_TRUE(shown.faults.empty()) << "nothing is lost";
    const Numbered good = numbered(
        "a.tsct", "material { name: \"m\" base_color { r: 1 } emissive { r: 500 } metallic: 1 roughness: 0 }\n" +
                      std::string(kBox));
    EXPECT_EQ(good.all(), "");
    EXPECT_EQ(good.material->emissive, Vec3f(500, 0, 0)) << "light of any strength";
    const Numbered none = numbered("a.tsct", "material { name: \"m\" roughness: nan }\n" + std::string(kBox));
    EXPECT_WORDS(none.error);
}

TEST(NumbersOfMaterials, OutOfTheirBoundsAreNamedInWhatWasSaved) {
    Expected<ImportedScene> made = [] {
        const Scratch scratch;
        return importScene(scratch.write("in.tsct", "material { name: \"m\" roughness: 0.8125 }\n" + std::string(kBox)),
                           kRootNode, importOptions());
    }();
    ASSERT_TRUE(made) << messageOf(made);
    const ImportedAspect scene(std::move(*made));
    for (const SceneEncoding encoding : {SceneEncoding::kText, SceneEncoding::kBinary}) {
        Expected<std::string> bytes = writeScene(*scene, encoding);
        ASSERT_TRUE(bytes);
        const bool text = encoding == SceneEncoding::kText;
        const auto raw = [](float number) {
            return std::string(reinterpret_cast<const char*>(&number), sizeof(number));
        };
        const std::string good = text ? "0.8125" : raw(0.8125f), bad = text ? "9" : raw(9);
        const std::size_t at = bytes->find(good);
        ASSERT_NE(at, std::string::npos);
        bytes->replace(at, good.size(), bad);
        const Numbered shown = numbered(text ? "saved.tsct" : "saved.tsc", *bytes);
        ASSERT_TRUE(shown.material) << shown.all();
        EXPECT_EQ(shown.material->roughness, 1.0f);
        ASSERT_EQ(shown.mended.size(), 1u) << shown.all();
        EXPECT_TRUE(shown.mended[0].starts_with(shown.path + ":")) << shown.mended[0];
        EXPECT_TRUE(shown.mended[0].ends_with(std::string(text ? ": Material" : " (Material)") +
                                              ": roughness 9 is not between 0 and 1: 1 is taken"))
            << shown.mended[0];
        EXPECT_EQ(std::ranges::count(shown.mended[0].substr(shown.path.size(), 12), ':') >= 3, text)
            << "a text has lines: " << shown.mended[0];
    }
}

TEST(NumbersOfMaterials, OfGltfAreNamedAsItCallsThem) {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const Numbered shown = numbered("a.gltf", gltf.text(fmt::format(
                                                  R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}},"material":0}}]}}],
        "materials":[{{"name":"brick","pbrMetallicRoughness":{{"roughnessFactor":9,"metallicFactor":-2,
        "baseColorFactor":[3,1,1,1]}},"alphaMode":"MASK","alphaCutoff":-1,
        "emissiveFactor":[0.5,0,2],"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":4}},
        "KHR_materials_clearcoat":{{"clearcoatFactor":1.5}},
        "KHR_materials_ior":{{"ior":0.25}}}}}}])",
                                                  positions)));
    ASSERT_TRUE(shown.material) << shown.all();
    EXPECT_EQ(shown.material->roughness, 1.0f);
    EXPECT_EQ(shown.material->metallic, 0.0f);
    EXPECT_EQ(shown.material->emissive, Vec3f(2, 0, 4));
    for (const std::string& note : shown.notes) EXPECT_WORDS(note);
    EXPECT_TRUE(shown.mended.empty()) << "it is somebody else's file";
}

TEST(NumbersOfMaterials, OfOtherModelsCostNoModel) {
    const std::string obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n";
    const Numbered shown = numbered("a.obj", obj, {{"m.mtl", "newmtl paint\nKd 2 0.5 -1\nKe 3 0 0\nPr 1.5\n"}});
    ASSERT_TRUE(shown.material) << shown.all();
    EXPECT_EQ(shown.material->baseColor, Vec4f(1, 0.5f, 0, 1));
    EXPECT_EQ(shown.material->emissive, Vec3f(3, 0, 0));
    for (const std::string& note : shown.notes) EXPECT_WORDS(note);
    const Numbered none = numbered("a.obj", obj, {{"m.mtl", "newmtl paint\nKd nan 0.5 0.5\n"}});
    ASSERT_TRUE(none.material) << none.all();
    EXPECT_TRUE(none.material->baseColor.allFinite());
    EXPECT_WORDS(none.all());
}

}  // namespace
}  // namespace tessera
