// glTF's materials, property by property.

#include <fmt/format.h>

#include <numbers>

#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

/// A triangle with one material and four textures: 0 and 1 show image 0, 2 image 1, 3 an image that cannot be decoded.
class GltfMaterials : public testing::Test {
protected:
    /// `textures`: others than those above.
    const Material* import(const std::string& material, const std::string& textures = "",
                           const std::string& more = "") {
        GltfText gltf;
        const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
        const int first = gltf.floats({0, 0, 1, 0, 0, 1}, "VEC2", 2),
                  second = gltf.floats({0, 0, 2, 0, 0, 2}, "VEC2", 2);
        const auto uri = [](const std::string& bytes) { return "data:image/png;base64," + base64(bytes); };
        const std::string rest = fmt::format(
            R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],"materials":[{}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"TEXCOORD_0":{},"TEXCOORD_1":{}}},
            "material":0}}]}}],
            "textures":[{}],"images":[{{"uri":"{}"}},{{"uri":"{}"}},{{"uri":"{}"}}]{})",
            material, positions, first, second,
            textures.empty() ? R"({"source":0},{"source":0},{"source":1},{"source":2})" : textures,
            uri(pictureOf({{255, 0, 0, 255}, {0, 255, 0, 0}})), uri(pictureOf({{1, 2, 3, 4}})), uri("nothing"), more);
        const Scratch scratch;
        Expected<ImportedScene> read =
            importScene(scratch.write("model.gltf", gltf.text(rest)), kRootNode, importOptions());
        EXPECT_TRUE(read) << messageOf(read);
        if (!read) return nullptr;
        scene_ = *read;
        aspect_ = std::make_unique<ImportedAspect>(std::move(*read));
        return aspect()->get<Material>(geometry()->material);
    }
    const ImportedAspect& aspect() const { return *aspect_; }
    const Geometry* geometry() const { return aspect().core<Geometry>("/model/n/part 0"); }
    const Image* image(ObjectId id) const { return aspect()->get<Image>(id); }

    ImportedScene scene_;
    std::unique_ptr<ImportedAspect> aspect_;
};

TEST_F(GltfMaterials, TakeAllFiveTexturesAndTheirNumbers) {
    const Material* material = import(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
        "metallicRoughnessTexture":{"index":2},"metallicFactor":0.5,"roughnessFactor":0.25},
        "normalTexture":{"index":2,"scale":-0.5},"occlusionTexture":{"index":2,"strength":0.75,"texCoord":1},
        "emissiveTexture":{"index":0},"emissiveFactor":[1,0.5,0],
        "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4}}})");
    ASSERT_NE(material, nullptr);
    ASSERT_NE(image(material->baseColorImage), nullptr);
    EXPECT_EQ(image(material->baseColorImage)->widthPx, 2);
    EXPECT_EQ(image(material->baseColorImage)->pixels.as<std::uint8_t>()[7], 0) << "alpha is kept";
    EXPECT_EQ(material->emissiveImage, material->baseColorImage);
    EXPECT_EQ(material->emissive, Vec3f(4, 2, 0));
    ASSERT_NE(image(material->metallicRoughnessImage), nullptr);
    EXPECT_EQ(image(material->metallicRoughnessImage)->widthPx, 1);
    EXPECT_FLOAT_EQ(material->metallic, 0.5f);
    EXPECT_FLOAT_EQ(material->roughness, 0.25f);
    EXPECT_EQ(material->normalImage, material->metallicRoughnessImage);
    EXPECT_FLOAT_EQ(material->normalScale, -0.5f);
    EXPECT_NE(material->occlusionImage, material->normalImage) << "other texture coordinates are another image";
    EXPECT_EQ(image(material->occlusionImage)->texcoordSet, 1);
    EXPECT_EQ(image(material->occlusionImage)->pixels.id(), image(material->normalImage)->pixels.id())
        << "of the same pixels";
    EXPECT_FLOAT_EQ(material->occlusionStrength, 0.75f);
    EXPECT_TRUE(scene_.notes.empty()) << scene_.notes.front();
}

// glTF 2.0, 3.9.7, and the defaults of 5.19 and 5.22.
TEST(GltfMaterial, OfASurfaceWithoutOneIsTheDefaultMaterial) {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const std::string rest = fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{0}}}}},{{"attributes":{{"POSITION":{0}}}}},
        {{"attributes":{{"POSITION":{0}}},"mode":0}}]}}])",
        positions);
    const Scratch scratch;
    Expected<ImportedScene> read =
        importScene(scratch.write("model.gltf", gltf.text(rest)), kRootNode, importOptions());
    ASSERT_TRUE(read) << messageOf(read);
    const ImportedAspect aspect(std::move(*read));
    const ObjectId id = aspect.core<Geometry>("/model/n/part 0")->material;
    const Material* material = aspect->get<Material>(id);
    ASSERT_NE(material, nullptr);
    EXPECT_EQ(material->baseColor, Vec4f(1, 1, 1, 1));
    EXPECT_EQ(material->metallic, 1);
    EXPECT_EQ(material->roughness, 1);
    EXPECT_EQ(aspect.core<Geometry>("/model/n/part 1")->material, id) << "there is one of it";
    EXPECT_FALSE(aspect.core<Geometry>("/model/n/part 2")->material) << "points have none";
}

TEST_F(GltfMaterials, KeepTheSecondTextureCoordinates) {
    import("{}");
    const auto second = geometry()->texcoords1.as<float>();
    EXPECT_EQ(std::vector<float>(second.begin(), second.end()), (std::vector<float>{0, 0, 2, 0, 0, 2}));
    EXPECT_FLOAT_EQ(geometry()->texcoords.as<float>()[2], 1);
}

TEST_F(GltfMaterials, TakeSamplersAndTheirDefaults) {
    const auto sampled = [&](const std::string& sampler) {
        const Material* material = import(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})",
                                          R"({"source":0,"sampler":0})", R"(,"samplers":[{)" + sampler + "}]");
        return *image(material->baseColorImage);
    };
    const Image plain = sampled("");
    EXPECT_EQ(plain.wrapU, Image::kRepeat);
    EXPECT_EQ(plain.wrapV, Image::kRepeat);
    EXPECT_EQ(plain.magnification, Image::kLinear);
    EXPECT_EQ(plain.minification, Image::kTrilinear);
    const Image said = sampled(R"("wrapS":33071,"wrapT":33648,"magFilter":9728,"minFilter":9985)");
    EXPECT_EQ(said.wrapU, Image::kClamp);
    EXPECT_EQ(said.wrapV, Image::kMirror);
    EXPECT_EQ(said.magnification, Image::kNearest);
    EXPECT_EQ(said.minification, Image::kLinearOfNearest);
    const std::pair<int, std::int64_t> filters[] = {{9728, Image::kNearestAlone},
                                                    {9729, Image::kLinearAlone},
                                                    {9984, Image::kNearestOfNearest},
                                                    {9986, Image::kNearestOfTwo},
                                                    {9987, Image::kTrilinear}};
    for (const auto& [number, ours] : filters)
        EXPECT_EQ(sampled(fmt::format(R"("minFilter":{})", number)).minification, ours) << number;
}

TEST_F(GltfMaterials, TakeTheTransformOfATexture) {
    const Material* material = import(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{
        "KHR_texture_transform":{"offset":[0.5,-0.25],"scale":[2,3],"rotation":1.5,"texCoord":1}}}},
        "emissiveTexture":{"index":0,"extensions":{"KHR_texture_transform":{}}}})");
    const Image* placed = image(material->baseColorImage);
    ASSERT_NE(placed, nullptr);
    EXPECT_EQ(placed->offset, Vec2f(0.5f, -0.25f));
    EXPECT_EQ(placed->scale, Vec2f(2, 3));
    EXPECT_NEAR(placed->rotation, 1.5f, 1e-6f);
    EXPECT_EQ(placed->texcoordSet, 1) << "the extension has the last word";
    const Image* plain = image(material->emissiveImage);
    EXPECT_EQ(plain->scale, Vec2f(1, 1));
    EXPECT_EQ(plain->pixels.id(), placed->pixels.id());
}

TEST_F(GltfMaterials, AreOneImageForEachDifferenceAndSharePixels) {
    // Texture 1 is texture 0 again.
    const Material* material = import(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
        "metallicRoughnessTexture":{"index":1}},"normalTexture":{"index":1,"texCoord":1}})");
    EXPECT_EQ(material->baseColorImage, material->metallicRoughnessImage);
    EXPECT_EQ(allOf<Image>(aspect()).size(), 2u);
}

TEST_F(GltfMaterials, SayWhatAlphaMeans) {
    const auto of = [&](const std::string& mode) {
        return *import(R"({"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]})" + mode + "}");
    };
    const Material opaque = of("");
    EXPECT_EQ(opaque.alphaMode, Material::kOpaque);
    EXPECT_FLOAT_EQ(opaque.baseColor.w(), 1) << "glTF ignores it";
    const Material mask = of(R"(,"alphaMode":"MASK","alphaCutoff":0.125)");
    EXPECT_EQ(mask.alphaMode, Material::kMask);
    EXPECT_FLOAT_EQ(mask.alphaCutoff, 0.125f);
    EXPECT_FLOAT_EQ(mask.baseColor.w(), 0.25f);
    EXPECT_FLOAT_EQ(of(R"(,"alphaMode":"MASK")").alphaCutoff, 0.5f);
    const Material blend = of(R"(,"alphaMode":"BLEND")");
    EXPECT_EQ(blend.alphaMode, Material::kBlend);
    EXPECT_FLOAT_EQ(blend.baseColor.w(), 0.25f);
}

TEST_F(GltfMaterials, MayBeUnlit) {
    EXPECT_FALSE(import("{}")->unlit);
    EXPECT_TRUE(import(R"({"extensions":{"KHR_materials_unlit":{}}})")->unlit);
}

TEST_F(GltfMaterials, HaveLacquerAndLetLightThrough) {
    const Material* material = import(R"({"extensions":{
        "KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatRoughnessFactor":0.25,
        "clearcoatTexture":{"index":0}},
        "KHR_materials_transmission":{"transmissionFactor":0.75,"transmissionTexture":{"index":0}}}})");
    EXPECT_FLOAT_EQ(material->clearcoat, 0.5f);
    EXPECT_FLOAT_EQ(material->clearcoatRoughness, 0.25f);
    EXPECT_FLOAT_EQ(material->transmission, 0.75f);
    EXPECT_WORDS(notesIn(scene_));
    EXPECT_EQ(scene_.notes.size(), 2u);
}

TEST_F(GltfMaterials, SayHowTheyReflect) {
    const Material* material = import(R"({"extensions":{
        "KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[0.25,1,2],"specularTexture":{"index":0},
        "specularColorTexture":{"index":0}},
        "KHR_materials_ior":{"ior":1.75}}})");
    EXPECT_FLOAT_EQ(material->specular, 0.5f);
    EXPECT_EQ(material->specularColor, Vec3f(0.25f, 1, 2));
    EXPECT_FLOAT_EQ(material->ior, 1.75f);
    EXPECT_WORDS(notesIn(scene_));
    EXPECT_EQ(scene_.notes.size(), 2u);
    // 0 reflects everything; what makes no sense is brought back.
    EXPECT_FLOAT_EQ(import(R"({"extensions":{"KHR_materials_ior":{"ior":0}}})")->ior, 100);
    EXPECT_FLOAT_EQ(import(R"({"extensions":{"KHR_materials_ior":{"ior":0.5}}})")->ior, 1);
    EXPECT_FLOAT_EQ(import(R"({"extensions":{"KHR_materials_specular":{}}})")->specular, 1);
}

TEST_F(GltfMaterials, OfSpecularAndGlossinessAreConverted) {
    const Material* material = import(R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{
        "diffuseFactor":[0.1,0.2,0.3,0.4],"glossinessFactor":0.75,"diffuseTexture":{"index":0,"texCoord":1}}},
        "alphaMode":"BLEND"})");
    EXPECT_EQ(material->baseColor, Vec4f(0.1f, 0.2f, 0.3f, 0.4f));
    EXPECT_FLOAT_EQ(material->metallic, 0);
    EXPECT_FLOAT_EQ(material->roughness, 0.25f);
    ASSERT_NE(image(material->baseColorImage), nullptr);
    EXPECT_EQ(image(material->baseColorImage)->texcoordSet, 1);
    EXPECT_WORDS(notesIn(scene_));
}

TEST_F(GltfMaterials, NameWhatTheyLeaveOut) {
    const Material* material = import(R"({"extensions":{"KHR_materials_sheen":{"sheenRoughnessFactor":1}},
        "pbrMetallicRoughness":{"baseColorTexture":{"index":3}},"normalTexture":{"index":0,"texCoord":2},
        "emissiveTexture":{"index":7}})",
                                      "", R"(,"extensionsUsed":["EXT_mesh_manifold"])");
    EXPECT_FALSE(material->baseColorImage);
    EXPECT_FALSE(material->normalImage);
    for (const std::string& note : scene_.notes) EXPECT_WORDS(note);
    EXPECT_EQ(scene_.notes.size(), 5u);
}

TEST_F(GltfMaterials, BeyondTheirBoundsAreBroughtBack) {
    const Material* material = import(R"({"pbrMetallicRoughness":{"metallicFactor":7,"roughnessFactor":-1},
        "normalTexture":{"index":0,"scale":1e9},"occlusionTexture":{"index":0,"strength":2},"alphaMode":"MASK",
        "alphaCutoff":-1,
        "extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":5}}})");
    EXPECT_FLOAT_EQ(material->metallic, 1);
    EXPECT_FLOAT_EQ(material->roughness, 0);
    EXPECT_FLOAT_EQ(material->normalScale, 1000);
    EXPECT_FLOAT_EQ(material->occlusionStrength, 1);
    EXPECT_FLOAT_EQ(material->alphaCutoff, 0);
    EXPECT_FLOAT_EQ(material->clearcoat, 1);
}

TEST(GltfClearCoatSample, BlendsWhereItsPictureIsTransparent) {
    const std::string path = std::string(kDebianModels) + "/glTF2/ClearCoat-glTF/ClearCoatTest.gltf";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing (Debian package assimp-testmodels)";
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    std::size_t blended = 0;
    for (const Material* material : allOf<Material>(aspect)) {
        if (material->alphaMode != Material::kBlend) continue;
        ++blended;
        const auto* image = aspect->get<Image>(material->baseColorImage);
        ASSERT_NE(image, nullptr);
        EXPECT_EQ(image->pixels.as<std::uint8_t>()[3], 0) << "its upper left corner is not there";
    }
    EXPECT_EQ(blended, 1u);
}

}  // namespace
}  // namespace tessera
