// Tangents of files: glTF's TANGENT, of meshes, skins and morph targets, and those of texts.

#include "common/cores/Deformation.h"
#include "common/cores/Geometry.h"
#include "common/cores/Skin.h"
#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

std::vector<float> numbersOf(const Blob& blob) {
    const auto all = blob.as<float>();
    return {all.begin(), all.end()};
}

/// A triangle of these attributes beside POSITION; `more`: of its primitive.
Expected<ImportedScene> importTriangle(GltfText& gltf, const std::string& attributes, const std::string& more = "") {
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const Scratch scratch;
    return importScene(scratch.write("model.gltf", gltf.text(fmt::format(
                                                       R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"n","mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}{}}}{}}}]}}])",
                                                       positions, attributes, more))),
                       kRootNode, importOptions());
}

std::vector<float> tangentsOf(const std::vector<float>& tangents, bool normals) {
    GltfText gltf;
    std::string attributes = fmt::format(R"(,"TANGENT":{})", gltf.floats(tangents, "VEC4", 4));
    if (normals) attributes += fmt::format(R"(,"NORMAL":{})", gltf.floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3));
    Expected<ImportedScene> scene = importTriangle(gltf, attributes);
    EXPECT_TRUE(scene) << messageOf(scene);
    if (!scene) return {};
    const ImportedAspect aspect(std::move(*scene));
    const auto* geometry = aspect.core<Geometry>("/model/n/part 0");
    EXPECT_NE(geometry, nullptr);
    return geometry ? numbersOf(geometry->tangents) : std::vector<float>();
}

TEST(Tangents, AreTheFilesOfUnitLengthAndOneSide) {
    const std::vector<float> sound = {1, 0, 0, 1, 0, 1, 0, -1, 1, 0, 0, 1};
    EXPECT_EQ(tangentsOf(sound, true), sound);
    EXPECT_EQ(tangentsOf({2, 0, 0, 1, 0, 0.5f, 0, -0.25f, 0, 0, 0, 0}, true),
              (std::vector<float>{1, 0, 0, 1, 0, 1, 0, -1, 0, 0, 0, 1}));
    EXPECT_TRUE(tangentsOf(sound, false).empty()) << "glTF: of normals that are computed they say nothing";
}

TEST(Tangents, OfAnotherNumberOfVerticesAreRefused) {
    GltfText gltf;
    const std::string attributes = fmt::format(R"(,"TANGENT":{},"NORMAL":{})", gltf.floats({1, 0, 0, 1}, "VEC4", 4),
                                               gltf.floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3));
    const Expected<ImportedScene> scene = importTriangle(gltf, attributes);
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

TEST(Tangents, OfSkinsMoveByTheirTargets) {
    GltfText gltf;
    const std::string attributes =
        fmt::format(R"(,"TANGENT":{},"NORMAL":{})", gltf.floats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1}, "VEC4", 4),
                    gltf.floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3));
    const std::string target = fmt::format(R"(,"targets":[{{"TANGENT":{},"POSITION":{}}}])",
                                           gltf.floats({-1, 1, 0, 0, 0, 0, 0, 0, 1}, "VEC3", 3),
                                           gltf.floats(std::vector<float>(9, 0), "VEC3", 3));
    Expected<ImportedScene> scene = importTriangle(gltf, attributes, target);
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* read = aspect.core<Skin>("/model/n/part 0");
    ASSERT_NE(read, nullptr);
    EXPECT_EQ(numbersOf(read->tangents), (std::vector<float>{1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1}));
    Skin gone = *read;
    gone.weights = Blob::of(std::span<const float>(std::vector<float>{1}));
    const std::vector<float> moved = numbersOf(drawableOf(Object::of(gone)).arrays().tangents);
    ASSERT_EQ(moved.size(), 12u);
    EXPECT_EQ(std::vector<float>(moved.begin(), moved.begin() + 8), (std::vector<float>{0, 1, 0, 1, 1, 0, 0, 1}));
    EXPECT_NEAR(moved[10], std::sqrt(0.5f), 1e-6);
    EXPECT_EQ(moved[11], -1);
}

// Two triangles of a skin that share an edge along which the image is mirrored: their corners there are four vertices.
TEST(Tangents, OfSkinsWithNormalMapsAreMadeOnce) {
    for (const bool mapped : {true, false}) {
        GltfText gltf;
        const int positions = gltf.floats({0, 0, 0, 0, 1, 0, 1, 0, 0, -1, 0, 0}, "VEC3", 3),
                  normals = gltf.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3),
                  texcoords = gltf.floats({0, 1, 0, 0, 1, 1, 1, 1}, "VEC2", 2),
                  joints = gltf.add(std::vector<std::uint16_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}, 5123,
                                    "VEC4", 4),
                  weights = gltf.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4", 4),
                  moved = gltf.floats({0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4}, "VEC3", 3),
                  indices = gltf.add(std::vector<std::uint16_t>{0, 2, 1, 0, 1, 3}, 5123, "SCALAR", 6);
        const Scratch scratch;
        Expected<ImportedScene> scene = importScene(
            scratch.write("model.gltf",
                          gltf.text(fmt::format(
                              R"("scenes":[{{"nodes":[0,1,2]}}],
            "nodes":[{{"name":"n","mesh":0,"skin":0}},{{"name":"a"}},{{"name":"b"}}],
            "skins":[{{"joints":[1,2]}}],"materials":[{{{}}}],"textures":[{{"source":0}}],
            "images":[{{"uri":"data:image/png;base64,{}"}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"NORMAL":{},"TEXCOORD_0":{},"JOINTS_0":{},
            "WEIGHTS_0":{}}},"indices":{},"material":0,"targets":[{{"POSITION":{}}}]}}]}}])",
                              mapped ? R"("normalTexture":{"index":0})" : "", base64(pictureOf({{127, 127, 255, 255}})),
                              positions, normals, texcoords, joints, weights, indices, moved))),
            kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        const ImportedAspect aspect(std::move(*scene));
        const auto* skin = aspect.core<Skin>("/model/n/part 0");
        ASSERT_NE(skin, nullptr);
        EXPECT_TRUE(drawableOf(Object::of(*skin)).check());
        if (!mapped) {
            EXPECT_TRUE(skin->tangents.empty());
            EXPECT_EQ(skin->positions.sizeBytes(), 4u * 12);
            continue;
        }
        EXPECT_EQ(numbersOf(skin->tangents), (std::vector<float>{1,  0, 0, 1,  1,  0, 0, 1,  1,  0, 0, 1,  //
                                                                 -1, 0, 0, -1, -1, 0, 0, -1, -1, 0, 0, -1}));
        EXPECT_EQ(numbersOf(skin->positions),
                  (std::vector<float>{0, 0, 0, 0, 1, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1, 0}));
        const auto indicesIs = skin->indices.as<std::uint32_t>();
        EXPECT_EQ(std::vector<std::uint32_t>(indicesIs.begin(), indicesIs.end()),
                  (std::vector<std::uint32_t>{0, 2, 1, 4, 5, 3}));
        const auto jointsIs = skin->jointIndices.as<std::uint16_t>();
        ASSERT_EQ(jointsIs.size(), 24u);
        EXPECT_EQ(jointsIs[16], 0);
        EXPECT_EQ(jointsIs[20], 1) << "the copy follows the joint of its vertex";
        EXPECT_EQ(numbersOf(skin->morphPositions),
                  (std::vector<float>{0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 1, 0, 0, 2}));
    }
}

constexpr const char* kTangentText = R"(
    mesh { name: "t" position: [0, 0, 0, 1, 0, 0, 0, 1, 0] normal: [0, 0, 1, 0, 0, 1, 0, 0, 1]
           tangent: [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, -1] }
    node { name: "n" geometry { mesh: "t" } }
    node { name: "bent" geometry { mesh: "t" } lattice { points_x: 2 points_y: 2 points_z: 2 } })";

TEST(Tangents, OfTextsAreTaken) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write("scene.tsct", kTangentText), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const std::vector<float> said = {0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, -1};
    ASSERT_NE(aspect.core<Geometry>("/n"), nullptr);
    EXPECT_EQ(numbersOf(aspect.core<Geometry>("/n")->tangents), said);
    ASSERT_NE(aspect.core<Deformation>("/bent"), nullptr);
    EXPECT_EQ(numbersOf(aspect.core<Deformation>("/bent")->tangents), said);
    std::string fewer = kTangentText;
    fewer.replace(fewer.find(", 0, 1, 0, -1]"), 14, "]");
    const auto refused = importScene(scratch.write("fewer.tsct", fewer), kRootNode, importOptions());
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
}

}  // namespace
}  // namespace tessera
