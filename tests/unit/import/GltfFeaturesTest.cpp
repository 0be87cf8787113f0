// Small glTF files written here, one feature each.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/PointLight.h"
#include "common/cores/Skin.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Transform.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/ImportFixture.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

ImportedScene imported(const std::string& text) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write("model.gltf", text), kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    return scene ? std::move(*scene) : ImportedScene{};
}

const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

std::vector<std::uint32_t> indicesOf(const std::string& primitive, const GltfText& gltf) {
    const ImportedAspect aspect(imported(gltf.text(
        fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],"meshes":[{{"primitives":[{}]}}])",
                    primitive))));
    const auto* geometry = aspect.core<Geometry>("/model/n/part 0");
    if (geometry == nullptr) return {};
    const auto indices = geometry->indices.as<std::uint32_t>();
    return {indices.begin(), indices.end()};
}

TEST(GltfPrimitive, StripsFansAndMissingIndicesBecomeTriangles) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const auto mode = [&](int number) {
        return fmt::format(R"({{"attributes":{{"POSITION":{}}},"mode":{}}})", positions, number);
    };
    using Indices = std::vector<std::uint32_t>;
    EXPECT_EQ(indicesOf(mode(4), gltf), (Indices{0, 1, 2}));
    EXPECT_EQ(indicesOf(mode(5), gltf), (Indices{0, 1, 2, 1, 3, 2})) << "every second triangle of a strip is turned";
    EXPECT_EQ(indicesOf(mode(6), gltf), (Indices{0, 1, 2, 0, 2, 3}));
    const int bytes = gltf.add(std::vector<std::uint8_t>{2, 1, 0}, 5121, "SCALAR", 3);
    EXPECT_EQ(indicesOf(fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{}}})", positions, bytes), gltf),
              (Indices{2, 1, 0}));
}

TEST(GltfPrimitive, MissingNormalsAreComputedAndColoursBecomeSrgb) {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const int colors = gltf.add(std::vector<std::uint16_t>{65535, 0, 0, 0, 0, 0, 14065, 65535, 0, 0, 0, 0}, 5123,
                                "VEC4", 3, R"(,"normalized":true)");
    const ImportedAspect aspect(imported(
        gltf.text(fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],)"
                              R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"COLOR_0":{}}}}}]}}])",
                              positions, colors))));
    const auto* geometry = aspect.core<Geometry>("/model/n/part 0");
    ASSERT_NE(geometry, nullptr);
    EXPECT_FLOAT_EQ(geometry->normals.as<float>()[2], 1.0f);
    const auto color = geometry->colors.as<std::uint8_t>();
    ASSERT_EQ(color.size(), 12u);
    EXPECT_EQ(color[0], 255);
    EXPECT_EQ(color[6], 128) << "linear 0.2146 is sRGB 0.5";
    EXPECT_EQ(color[7], 255) << "alpha stays linear";
}

TEST(GltfPrimitive, SparseAccessorsReplaceElements) {
    GltfText gltf;
    const int positions =
        gltf.add(kSquare, 5126, "VEC3", 4,
                 R"(,"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":2}})");
    gltf.add(std::vector<std::uint16_t>{2}, 5123, "SCALAR", 1);
    gltf.floats({7, 8, 9}, "VEC3", 3);
    const ImportedAspect aspect(
        imported(gltf.text(fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],)"
                                       R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}])",
                                       positions))));
    const auto vertices = aspect.core<Geometry>("/model/n/part 0")->positions.as<float>();
    EXPECT_EQ(std::vector<float>(vertices.begin() + 6, vertices.begin() + 9), (std::vector<float>{7, 8, 9}));
}

TEST(GltfNode, MatricesBecomeTransformsEvenThoseThatMirrorOrShear) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    // Column-major: a turn about z with scale 2, 3, 4; a reflection; a shear.
    const std::string rest = fmt::format(
        R"("scenes":[{{"nodes":[0,1,2]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],"nodes":[
        {{"name":"turned","mesh":0,"matrix":[0,2,0,0, -3,0,0,0, 0,0,4,0, 5,6,7,1]}},
        {{"name":"mirrored","mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}},
        {{"name":"sheared","mesh":0,"matrix":[1,0,0,0, 0.5,1,0,0, 0,0.25,-2,0, 1,2,3,1]}}])",
        positions);
    const ImportedAspect aspect(imported(gltf.text(rest)));
    const auto* turned = aspect.core<Transform>("/model/turned");
    EXPECT_TRUE(turned->scale.isApprox(Vec3d(2, 3, 4)));
    EXPECT_NEAR(std::abs(turned->rotation.w()), std::sqrt(0.5), 1e-9);
    const auto worldOf = [&](const char* path) { return worldTransform(*aspect, *findNode(*aspect, path)); };
    Affine3d expected = Affine3d::Identity();
    expected.linear() << 0, -3, 0, 2, 0, 0, 0, 0, 4;
    expected.translation() = Vec3d(5, 6, 7);
    EXPECT_TRUE(worldOf("/model/turned/part 0").isApprox(expected, 1e-9));
    EXPECT_LT(worldOf("/model/mirrored/part 0").linear().determinant(), 0.0);
    expected.linear() << 1, 0.5, 0, 0, 1, 0.25, 0, 0, -2;
    expected.translation() = Vec3d(1, 2, 3);
    EXPECT_TRUE(worldOf("/model/sheared/shear/part 0").isApprox(expected, 1e-9))
        << "two transforms say exactly what one cannot";
}

TEST(GltfCamera, ShowsAtTheScenesMiddleWhatTheFilesCameraShows) {
    GltfText gltf;
    // A square of side 2 around the origin; a camera 10 away on +z, its field 2·atan(0.09): 1.8 high at the middle.
    const int positions = gltf.floats({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3", 3);
    const ImportedScene scene = imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0,1]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}},"mode":6}}]}}],
        "cameras":[{{"type":"perspective","name":"eye","perspective":{{"yfov":{},"znear":0.1}}}}],
        "nodes":[{{"mesh":0}},{{"name":"tripod","camera":0,"translation":[0,0,10]}}])",
        positions, 2 * std::atan(0.09))));
    EXPECT_TRUE(scene.hasCamera);
    const ImportedAspect aspect{ImportedScene(scene)};
    const auto* camera = aspect.core<Camera>("/model/tripod/eye/camera");
    ASSERT_NE(camera, nullptr);
    EXPECT_NEAR(camera->worldUnitsPerMetre, 1.0, 1e-6);
    const Affine3d world_T_wall = worldTransform(*aspect, *findNode(*aspect, "/model/tripod/eye"));
    EXPECT_LT((world_T_wall * Vec3d(0, 1.5, 0)).norm(), 1e-6) << "the window's middle is the scene's";
}

TEST(GltfCamera, ThatCanShowNothingIsNamed) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const ImportedScene scene = imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":4,"znear":0.1}}}}],"nodes":[{{"mesh":0,"camera":0}}])",
        positions)));
    EXPECT_FALSE(scene.hasCamera);
    ASSERT_EQ(scene.notes.size(), 1u);
    EXPECT_WORDS(scene.notes[0]);
}

TEST(GltfMorph, StandsAsItsNodeSaysElseAsItsMesh) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const int moves = gltf.floats({0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3);
    const ImportedAspect aspect(imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0,1,2]}}],"nodes":[{{"name":"a","mesh":0}},{{"name":"b","mesh":0,"weights":[1]}},
        {{"name":"c","mesh":0}}],
        "meshes":[{{"weights":[0.5],"primitives":[{{"attributes":{{"POSITION":{}}},
        "targets":[{{"POSITION":{}}}]}}]}}])",
        positions, moves))));
    const auto height = [&](const char* node) {
        const Skin& skin = *aspect.core<Skin>(fmt::format("/model/{}/part 0", node));
        return drawableOf(Object::of(skin)).arrays().positions.as<float>()[2];
    };
    EXPECT_FLOAT_EQ(height("a"), 4);
    EXPECT_FLOAT_EQ(height("b"), 8);
    EXPECT_FLOAT_EQ(height("c"), 4);
}

TEST(GltfLights, AreDirectionalPointAndSpot) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const ImportedScene scene = imported(gltf.text(fmt::format(
        R"("extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[
        {{"type":"directional","intensity":2,"color":[1,0.5,0]}},{{"type":"point","range":4}},
        {{"type":"spot","range":2,"spot":{{"innerConeAngle":0.25,"outerConeAngle":0.5}}}}]}}}},
        "scenes":[{{"nodes":[0,1,2]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
        "nodes":[{{"name":"a","mesh":0,"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
        {{"name":"b","extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},
        {{"name":"c","extensions":{{"KHR_lights_punctual":{{"light":2}}}}}}])",
        positions)));
    EXPECT_TRUE(scene.notes.empty());
    const ImportedAspect aspect{ImportedScene(scene)};
    EXPECT_EQ(aspect.core<DirectionalLight>("/model/a/light 0")->color, Vec3f(1, 0.5f, 0));
    EXPECT_FLOAT_EQ(aspect.core<PointLight>("/model/b/light 1")->range, 4.0f);
    const auto* spot = aspect.core<SpotLight>("/model/c/light 2");
    ASSERT_NE(spot, nullptr);
    EXPECT_FLOAT_EQ(spot->range, 2.0f);
    EXPECT_FLOAT_EQ(spot->innerAngle, 0.25f);
    EXPECT_FLOAT_EQ(spot->outerAngle, 0.5f);
}

TEST(GltfLights, ThatAreLeftOutOrOddAreNamed) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const ImportedScene scene = imported(gltf.text(fmt::format(
        R"("extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[
        {{"type":"area"}},{{"type":"point","intensity":-1}},{{"type":"directional","intensity":100000}},
        {{"type":"spot","spot":{{"innerConeAngle":0.6,"outerConeAngle":0.5}}}},{{"type":"point","color":[-1,2,3]}},
        {{"type":"point","color":[1,2]}},{{"type":"point","intensity":1e39}},
        {{"type":"spot","spot":{{"outerConeAngle":3}}}}]}}}},
        "scenes":[{{"nodes":[0,1,2,3,4,5,6,7]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
        "nodes":[{{"name":"a","mesh":0,"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
        {{"name":"b","extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},
        {{"name":"c","extensions":{{"KHR_lights_punctual":{{"light":2}}}}}},
        {{"name":"d","extensions":{{"KHR_lights_punctual":{{"light":3}}}}}},
        {{"name":"e","extensions":{{"KHR_lights_punctual":{{"light":4}}}}}},
        {{"name":"f","extensions":{{"KHR_lights_punctual":{{"light":5}}}}}},
        {{"name":"g","extensions":{{"KHR_lights_punctual":{{"light":6}}}}}},
        {{"name":"h","extensions":{{"KHR_lights_punctual":{{"light":7}}}}}}])",
        positions)));
    for (const std::string& note : scene.notes) EXPECT_WORDS(note);
    const ImportedAspect aspect{ImportedScene(scene)};
    EXPECT_NE(aspect.core<DirectionalLight>("/model/c/light 2"), nullptr);
    EXPECT_NE(aspect.core<SpotLight>("/model/d/light 3"), nullptr);
    EXPECT_FALSE(findNode(*aspect, "/model/b/light 1"));
}

TEST(GltfLights, AsStrongAsRealOnesAreMeteredWhereTheModelItselfIsShown) {
    const std::string sunlit = std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/sunlit.glb";
    const auto shown = importScene(sunlit, kRootNode, importOptions());
    ASSERT_TRUE(shown) << messageOf(shown);
    EXPECT_WORDS(notesIn(*shown));
    const ImportedAspect aspect{ImportedScene(*shown)};
    const auto* environment = aspect.core<Environment>("/sunlit/exposure");
    ASSERT_NE(environment, nullptr);
    EXPECT_TRUE(environment->metered);
    EXPECT_EQ(environment->sky, Environment().sky) << "else it is that of a scene that has none";
    // As a part of something that says how it is exposed itself.
    ImportOptions part = importOptions();
    part.exposes = false;
    const Scratch scratch;
    std::filesystem::copy_file(sunlit, scratch.path("sunlit.glb"));
    const std::string text = scratch.write("yard.tsct", "node { import { uri: \"sunlit.glb\" } }\n");
    for (const auto& inside : {importScene(sunlit, kRootNode, part), importScene(text, kRootNode, importOptions())}) {
        ASSERT_TRUE(inside) << messageOf(inside);
        const ImportedAspect whole{ImportedScene(*inside)};
        for (const ObjectId id : whole->ids()) EXPECT_FALSE(whole->find(id).is<Environment>());
    }
}

TEST(GltfLights, ThatReckonWithoutAnExposureGetNone) {
    for (const double candela : {3.0, 40.0, 1000.0}) {
        GltfText gltf;
        const int positions = gltf.floats(kSquare, "VEC3", 3);
        const ImportedScene scene = imported(gltf.text(fmt::format(
            R"("extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[
            {{"type":"directional","intensity":3}},{{"type":"point","intensity":{}}}]}}}},
            "scenes":[{{"nodes":[0,1,2]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
            "nodes":[{{"name":"a","mesh":0}},{{"name":"b","extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
            {{"name":"c","translation":[0,0,5],"extensions":{{"KHR_lights_punctual":{{"light":1}}}}}}])",
            candela, positions)));
        // 3 lx, and so many candela at five metres.
        const ImportedAspect aspect{ImportedScene(scene)};
        bool metered = false;
        for (const ObjectId id : aspect->ids()) metered = metered || aspect->find(id).is<Environment>();
        EXPECT_EQ(metered, candela > 100) << candela;
    }
}

TEST(GltfLights, WhoseNumbersAreNoNumbersAreNamed) {
    const struct {
        const char *light, *node;
        bool isSound = false;
    } cases[] = {{R"({"type":"point","intensity":"5"})", "0"},
                 {R"({"type":"point","range":[4]})", "0"},
                 {R"({"type":"directional","color":"red"})", "0"},
                 {R"({"type":"directional","color":[1,"1",1]})", "0"},
                 {R"({"type":"spot","spot":{"outerConeAngle":true}})", "0"},
                 {R"({"type":"spot","spot":{"innerConeAngle":"wide"}})", "0"},
                 {R"({"type":"point"})", "\"0\""},
                 {R"({"type":"point"})", "0.5"},
                 {R"({"type":"point","intensity":5,"range":4.5,"color":[1,0,0.5]})", "0", true}};
    for (const auto& wrong : cases) {
        GltfText gltf;
        const int positions = gltf.floats(kSquare, "VEC3", 3);
        const ImportedScene scene = imported(gltf.text(fmt::format(
            R"("extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{}]}}}},
            "scenes":[{{"nodes":[0]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
            "nodes":[{{"name":"a","mesh":0,"extensions":{{"KHR_lights_punctual":{{"light":{}}}}}}}])",
            wrong.light, positions, wrong.node)));
        EXPECT_EQ(scene.notes.empty(), wrong.isSound) << wrong.light << ": " << notesIn(scene);
        for (const std::string& note : scene.notes) EXPECT_WORDS(note) << wrong.light;
    }
}

TEST(GltfMaterial, KeepsFactorsAndBlendsOnlyWhereAsked) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const ImportedAspect aspect(imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],"meshes":[{{"primitives":[
        {{"attributes":{{"POSITION":{0}}},"material":0}},{{"attributes":{{"POSITION":{0}}},"material":1}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.1,0.2,0.3,0.4],"metallicFactor":0.25,
        "roughnessFactor":0.75}},"doubleSided":true,
        "emissiveFactor":[0,0,1],"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":3}}}}}},
        {{"alphaMode":"BLEND","pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,0.4]}}}}])",
        positions))));
    const auto* solid = aspect->get<Material>(aspect.core<Geometry>("/model/n/part 0")->material);
    ASSERT_NE(solid, nullptr);
    EXPECT_EQ(solid->baseColor, Vec4f(0.1f, 0.2f, 0.3f, 1.0f));
    EXPECT_FLOAT_EQ(solid->metallic, 0.25f);
    EXPECT_FLOAT_EQ(solid->roughness, 0.75f);
    EXPECT_EQ(solid->doubleSided, 1);
    EXPECT_EQ(solid->emissive, Vec3f(0, 0, 3));
    const auto* glass = aspect->get<Material>(aspect.core<Geometry>("/model/n/part 1")->material);
    EXPECT_FLOAT_EQ(glass->baseColor.w(), 0.4f);
}

TEST(GltfAnimation, BecomesChannelsOfItsNodesTransform) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    const int times = gltf.floats({0, 1, 2}, "SCALAR", 1);
    const int moves = gltf.floats({0, 0, 0, 4, 0, 0, 4, 2, 0}, "VEC3", 3);
    const float half = std::sqrt(0.5f);
    const int turnTimes = gltf.floats({0.5f, 1}, "SCALAR", 1);
    const int turns = gltf.floats({0, 0, 0, 1, 0, half, 0, half}, "VEC4", 4);
    const ImportedAspect aspect(imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0,"scale":[2,2,2]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
        "animations":[{{"samplers":[{{"input":{},"output":{}}},{{"input":{},"output":{},"interpolation":"STEP"}}],
        "channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}},
        {{"sampler":1,"target":{{"node":0,"path":"rotation"}}}}]}}])",
        positions, times, moves, turnTimes, turns))));
    const auto* animation = aspect.core<Animation>("/model/animation 0");
    ASSERT_NE(animation, nullptr);
    EXPECT_TRUE(animation->playing);
    EXPECT_EQ(animation->mode, Animation::kLoop);
    ASSERT_EQ(animation->channels.size(), 2u);
    const auto* moved = aspect->get<KeyFrames>(animation->channels[0]);
    const auto* turned = aspect->get<KeyFrames>(animation->channels[1]);
    EXPECT_EQ(moved->target, aspect->get<Node>(*findNode(*aspect, "/model/n"))->core);
    EXPECT_EQ(moved->field, "translation");
    EXPECT_EQ(moved->interpolation, KeyFrames::kLinear);
    EXPECT_TRUE(std::ranges::equal(moved->times.as<double>(), std::vector<double>{0, 1, 2}));
    EXPECT_TRUE(std::ranges::equal(moved->values.as<double>(), std::vector<double>{0, 0, 0, 4, 0, 0, 4, 2, 0}));
    EXPECT_EQ(turned->field, "rotation");
    EXPECT_EQ(turned->interpolation, KeyFrames::kStep);
    EXPECT_TRUE(std::ranges::equal(turned->values.as<double>(), std::vector<double>{1, 0, 0, 0, half, 0, half, 0}))
        << "w x y z";
    EXPECT_EQ(aspect.core<Transform>("/model/n")->scale, Vec3d(2, 2, 2)) << "what is not animated stays";
}

TEST(GltfExtension, ThatIsRequiredAndUnknownIsNamed) {
    const Scratch scratch;
    const Expected<ImportedScene> scene = importScene(
        scratch.write("packed.gltf", R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_of_tomorrow"],)"
                                     R"("extensionsRequired":["EXT_of_tomorrow"],"scenes":[{"nodes":[]}]})"),
        kRootNode, importOptions());
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::kUnsupported);
    EXPECT_WORDS(scene.error().message);
}

TEST(GltfExtension, ThatIsRequiredIsNamedThoughTheRestMakesNoSenseWithoutIt) {
    const Scratch scratch;
    const Expected<ImportedScene> scene = importScene(
        scratch.write("packed.gltf",
                      R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_of_tomorrow"],)"
                      R"("extensionsRequired":["EXT_of_tomorrow"],"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
                      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[)"
                      R"({"componentType":5126,"count":3,"type":"VEC3"},{"componentType":5123,"count":3,)"
                      R"("type":"SCALAR"}]})"),
        kRootNode, importOptions());
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

TEST(ObjImport, TakesMaterialsFromTheLibraryBesideIt) {
    const Scratch scratch;
    scratch.write("paint.mtl", "newmtl red\nKd 0.9 0.1 0.2\nNs 98\nd 0.5\n");
    const std::string path = scratch.write(
        "box.obj", "mtllib paint.mtl\no lid\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3 4\n");
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 2u);
    const ImportedAspect aspect(std::move(*scene));
    const Material* red = nullptr;
    for (const ObjectId id : aspect->ids())
        if (const auto* material = aspect->get<Material>(id)) red = material;
    ASSERT_NE(red, nullptr);
    EXPECT_EQ(red->baseColor, Vec4f(0.9f, 0.1f, 0.2f, 0.5f));
    EXPECT_EQ(red->doubleSided, 1) << "an OBJ file does not say which side is outside";
    EXPECT_NEAR(red->roughness, std::pow(0.02f, 0.25f), 1e-3f);
    EXPECT_TRUE(findNode(*aspect, "/box"));
}

TEST(GltfAnimation, KeysThatVeryManyChannelsShareAreBoundedByTheFile) {
    GltfText gltf;
    const int positions = gltf.floats(kSquare, "VEC3", 3);
    std::vector<float> times(100'000);
    for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<float>(i);
    const int input = gltf.floats(times, "SCALAR", 1), output = gltf.floats(std::vector<float>(300'000), "VEC3", 3);
    std::string animations;
    for (int i = 0; i < 1000; ++i)
        animations += fmt::format(R"({}{{"samplers":[{{"input":{},"output":{}}}],
            "channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}]}})",
                                  i ? "," : "", input, output);
    const ImportedScene scene = imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],"animations":[{}])",
        positions, animations)));
    EXPECT_WORDS(notesIn(scene));
    const ImportedAspect aspect(scene);
    std::size_t channels = 0;
    for (const ObjectId id : aspect->ids()) channels += aspect->get<KeyFrames>(id) != nullptr;
    EXPECT_GE(channels, 200u);
    EXPECT_LE(channels, 250u);
}

TEST(GltfSkins, NeedNoInverseBindMatrices) {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3),
              joints = gltf.add(std::vector<std::uint8_t>(12), 5121, "VEC4", 3),
              weights = gltf.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4", 4);
    const ImportedScene scene = imported(gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0,"skin":0}},{{}}],"skins":[{{"joints":[1]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"JOINTS_0":{},"WEIGHTS_0":{}}}}}]}}])",
        positions, joints, weights)));
    EXPECT_FALSE(hasNote(scene, "Skin")) << fmt::format("{}", fmt::join(scene.notes, "\n"));
}

TEST(SharedData, AnimatedSkinnedAndTexturedSamplesKeepTheirParts) {
    const std::string data = testData();
    if (data.empty()) GTEST_SKIP() << "no folder of real models (TESSERA_TEST_DATA, or shared/data beside the project)";
    const auto has = [&](const std::string& file, ObjectType type) {
        Expected<ImportedScene> scene = importScene(data + "/gltf/" + file, kRootNode, importOptions());
        EXPECT_TRUE(scene) << messageOf(scene);
        if (!scene) return false;
        const ImportedAspect aspect(std::move(*scene));
        const std::vector<ObjectId> ids = aspect->ids();
        return std::any_of(ids.begin(), ids.end(), [&](ObjectId id) { return typeOf(aspect->find(id)) == type; });
    };
    EXPECT_TRUE(has("BoxAnimated.glb", typeOf<Animation>()));
    EXPECT_TRUE(has("BoxTextured.glb", typeOf<Image>()));
    EXPECT_TRUE(has("RiggedFigure.glb", typeOf<Skin>()));
    EXPECT_TRUE(has("Fox.glb", typeOf<Skin>()));
}

}  // namespace
}  // namespace tessera
