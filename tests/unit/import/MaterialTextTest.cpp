// Materials, images and second texture coordinates as authors write them, and as they are saved.

#include <fmt/format.h>

#include <numbers>

#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/scene/FieldTable.h"
#include "common/scenefile/SceneFile.h"
#include "tests/support/SceneStructure.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

constexpr const char* kEverything = R"(
    image { name: "a" uri: "a.tga" wrap_u: MIRROR wrap_v: CLAMP magnification: NEAREST
      minification: LINEAR_MIPMAP_NEAREST
            texcoord_set: 1 offset { x: 0.5 y: -0.25 } scale { x: 2 } rotation_deg: 90 }
    image { name: "b" uri: "a.tga" }
    material { name: "m" base_color { r: 1 g: 0.5 b: 0.25 a: 0.75 } metallic: 0.5 roughness: 0.25 emissive { r: 3 }
               base_color_image: "a" double_sided: true alpha_mode: MASK alpha_cutoff: 0.125
               metallic_roughness_image: "b" normal_image: "b" normal_scale: -2 occlusion_image: "b"
                 occlusion_strength: 0.5
               emissive_image: "a" unlit: true clearcoat: 0.5 clearcoat_roughness: 0.25 transmission: 0.75
               shading: PHONG specular: 0.625 specular_color { r: 0.5 g: 2 b: 1 } shininess: 12 ior: 1.25
               layer { image: "b" mode: DECAL strength: 0.25 source: REFLECTION } layer {} }
    mesh { name: "t" position: [0, 0, 0, 1, 0, 0, 0, 1, 0] index: [0, 1, 2]
           texcoord: [0, 0, 1, 0, 0, 1] texcoord1: [0, 0, 2, 0, 0, 2] }
    node { name: "n" geometry { mesh: "t" material: "m" } })";

Expected<ImportedScene> importWithPicture(const std::string& text) {
    const Scratch scratch;
    scratch.write("a.tga", pictureOf({{255, 0, 0, 255}, {0, 255, 0, 0}}));
    return importScene(scratch.write("scene.tsct", text), kRootNode, importOptions());
}

TEST(MaterialText, SaysEveryField) {
    Expected<ImportedScene> scene = importWithPicture(kEverything);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    const auto* geometry = aspect.core<Geometry>("/n");
    ASSERT_NE(geometry, nullptr);
    EXPECT_FLOAT_EQ(geometry->texcoords1.as<float>()[2], 2);
    const auto* m = aspect->get<Material>(geometry->material);
    ASSERT_NE(m, nullptr);
    EXPECT_EQ(m->baseColor, Vec4f(1, 0.5f, 0.25f, 0.75f));
    EXPECT_EQ(m->emissive, Vec3f(3, 0, 0));
    EXPECT_TRUE(m->doubleSided && m->unlit);
    EXPECT_EQ(m->alphaMode, Material::kMask);
    const std::pair<float, float> numbers[] = {
        {m->metallic, 0.5f},      {m->roughness, 0.25f},       {m->alphaCutoff, 0.125f},
        {m->normalScale, -2},     {m->specular, 0.625f},       {m->shininess, 12},
        {m->ior, 1.25f},          {m->clearcoat, 0.5f},        {m->clearcoatRoughness, 0.25f},
        {m->transmission, 0.75f}, {m->occlusionStrength, 0.5f}};
    for (const auto& [is, said] : numbers) EXPECT_EQ(is, said);
    EXPECT_EQ(m->shading, Material::kPhong);
    EXPECT_EQ(m->specularColor, Vec3f(0.5f, 2, 1));
    ASSERT_EQ(m->layers.size(), 2u);
    const auto* layer = aspect->get<TextureLayer>(m->layers[0]);
    ASSERT_NE(layer, nullptr);
    EXPECT_EQ(layer->image, m->normalImage);
    EXPECT_EQ(layer->mode, TextureLayer::kDecal);
    EXPECT_EQ(layer->strength, 0.25f);
    EXPECT_EQ(layer->source, TextureLayer::kReflection);
    EXPECT_FALSE(aspect->get<TextureLayer>(m->layers[1])->image);
    EXPECT_EQ(m->emissiveImage, m->baseColorImage);
    EXPECT_EQ(m->normalImage, m->metallicRoughnessImage);
    EXPECT_EQ(m->normalImage, m->occlusionImage);
    const auto* a = aspect->get<Image>(m->baseColorImage);
    const auto* b = aspect->get<Image>(m->normalImage);
    ASSERT_TRUE(a != nullptr && b != nullptr);
    EXPECT_EQ(a->pixels.id(), b->pixels.id()) << "decoded once";
    EXPECT_EQ(a->wrapU, Image::kMirror);
    EXPECT_EQ(a->wrapV, Image::kClamp);
    EXPECT_EQ(a->magnification, Image::kNearest);
    EXPECT_EQ(a->minification, Image::kLinearOfNearest);
    EXPECT_EQ(a->texcoordSet, 1);
    EXPECT_EQ(a->offset, Vec2f(0.5f, -0.25f));
    EXPECT_EQ(a->scale, Vec2f(2, 1)) << "a factor that is not said is 1";
    EXPECT_FLOAT_EQ(a->rotation, static_cast<float>(std::numbers::pi / 2));
}

template <typename T>
void expectFresh(const T& object) {
    for (const FieldEntry& field : findType(T::kType)->fields)
        EXPECT_TRUE(field.load(Object::of(object)) == field.load(Object::of(T()))) << field.name;
}

TEST(MaterialText, LeavesWhatItDoesNotSayAsInAFreshOne) {
    Expected<ImportedScene> scene = importWithPicture(R"(
        image { name: "a" uri: "a.tga" } material { name: "m" base_color_image: "a" }
        node { material: "m" box { size { x: 1 y: 1 z: 1 } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    Material material = *allOf<Material>(aspect).at(0);
    material.baseColorImage = {};
    expectFresh(material);
    Image image = *allOf<Image>(aspect).at(0);
    image.pixels = {};
    image.widthPx = image.heightPx = 0;
    expectFresh(image);
}

TEST(MaterialText, SavedAndReadBackIsTheSame) {
    Expected<ImportedScene> scene = importWithPicture(kEverything);
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const Scratch scratch;
    for (const char* name : {"saved.tsc", "saved.tsct"}) {
        const Expected<void> saved = saveScene(scratch.path(name), *aspect);
        ASSERT_TRUE(saved) << saved.error().message;
        Expected<ImportedScene> back = importScene(scratch.path(name), kRootNode, importOptions());
        ASSERT_TRUE(back) << messageOf(back);
        const ImportedAspect again(std::move(*back));
        EXPECT_EQ(structureDifference(*aspect, *again), "") << name;
    }
}

TEST(MaterialText, IsInThePrintedSchemaAsWrittenAndAsSaved) {
    const std::string schema = sceneSchemaText();
    for (const char* written :
         {"AlphaMode alpha_mode", "string emissive_image", "Minification minification", "repeated float texcoord1"})
        EXPECT_NE(schema.find(written), std::string::npos) << written;
    for (const char* saved : {"ALPHA_MODE_MASK", "occlusion_strength", "MINIFICATION_TRILINEAR", "texcoords1"})
        EXPECT_NE(schema.find(saved), std::string::npos) << saved;
}

/// Of looks alone no scene is lost; whoever checks it is told.
TEST(MaterialText, NumbersOutOfTheirBoundsAreNamedWithTheirPlace) {
    const std::pair<const char*, const char*> cases[] = {
        {"alpha_cutoff: -1", "alphaCutoff -1 is not between 0 and 1000000: 0 is taken"},
        {"clearcoat: 2", "clearcoat 2 is not between 0 and 1: 1 is taken"},
        {"ior: 0.5", "ior 0.5 is not between 1 and 100: 1 is taken"},
        {"shininess: -1", "shininess -1 is not between 0 and 10000: 0 is taken"},
        {"specular_color { r: -1 }", "specularColor -1 is not between 0 and 1000: 0 is taken"},
        {"line_width: 65", "lineWidth 65 is not between 0.1 and 64: 64 is taken"},
        {"coarser_below: -3", "coarserBelow -3 is not between 0 and 1000000: 0 is taken"}};
    for (const auto& [text, what] : cases) {
        const Expected<ImportedScene> scene =
            importWithPicture(std::string("material { name: \"m\" ") + text +
                              " }\nnode { material: \"m\" box { size { x: 1 y: 1 z: 1 } } }");
        ASSERT_TRUE(scene) << messageOf(scene);
        ASSERT_EQ(scene->mended.size(), 1u) << text;
        EXPECT_TRUE(scene->mended[0].ends_with(std::string("scene.tsct:1:22: material 'm': ") + what))
            << scene->mended[0];
    }
}

class MaterialTextError : public testing::TestWithParam<const char*> {};

TEST_P(MaterialTextError, SaysWhatIsWrong) {
    const std::string shown = std::string(GetParam()) + "\nnode { material: \"m\" box { size { x: 1 y: 1 z: 1 } } }";
    const Expected<ImportedScene> scene = importWithPicture(shown);
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

INSTANTIATE_TEST_SUITE_P(
    Each, MaterialTextError,
    testing::Values(
        "image { name: \"rust\" uri: \"a.tga\" }\nmaterial { name: \"m\" normal_image: \"rusty\" }",
        "material { name: \"m\" emissive_image: \"none\" }", "material { name: \"m\" alpha_mode: CUT }",
        "material { name: \"m\" layer { strength: 2 } }", "material { name: \"m\" layer { image: \"none\" } }",
        "material { name: \"m\" layer {} layer {} layer {} layer {} layer {} }",
        "material { name: \"m\" occlusion_strength: nan }",
        "image { name: \"a\" uri: \"a.tga\" texcoord_set: 2 } material { name: \"m\" base_color_image: \"a\" }",
        "image { name: \"a\" uri: \"a.tga\" rotation_deg: inf } material { name: \"m\" base_color_image: \"a\" }",
        "image { name: \"a\" uri: \"a.tga\" offset { z: 1 } } material { name: \"m\" base_color_image: \"a\" }",
        "material { name: \"m\" } mesh { name: \"t\" position: [0, 0, 0] index: [0, 0, 0] texcoord1: [1] }"));

}  // namespace
}  // namespace tessera
