// Animations and skins as people write them, and as glTF says them where that is not as it should be.

#include <cmath>

#include <fmt/format.h>

#include "common/cores/Animation.h"
#include "common/cores/Skin.h"
#include "common/drawable/Drawable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> movingScene(const std::string& text) {
    const Scratch scratch;
    return importScene(scratch.write("moving.tsct", text), kRootNode, importOptions());
}

const std::string kLamp = "node { name: \"lamp\" transform { translation { y: 2 } } point_light { intensity: 2 } }\n";

void isRefusedChannel(const std::string& channel) {
    const Expected<ImportedScene> scene = movingScene(
        kLamp + "material { name: \"red\" }\nnode { name: \"take\" animation { channel { " + channel + " } } }\n");
    ASSERT_FALSE(scene) << channel;
    EXPECT_WORDS(scene.error().message);
}

TEST(AnimationText, DrivesTransformContentAndMaterialByTheirFields) {
    Expected<ImportedScene> scene = movingScene(kLamp + R"(material { name: "red" }
node { name: "ball" material: "red" sphere { radius: 1 } }
node { name: "take" animation { mode: PING_PONG speed: -2 time: 0.5 paused: true
  channel { target: "lamp" field: "translation" time: [0, 1] value: [0, 2, 0, 0, 3, 0] }
  channel { target: "/lamp" field: "intensity" interpolation: STEP time: [0, 1] value: [1, 3] }
  channel { material: "red" field: "roughness" interpolation: SPLINE time: [0, 1]
    value: [0, 0.2, 0, 0, 0.8, 0] } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    const auto* take = aspect.core<Animation>("/take");
    ASSERT_NE(take, nullptr);
    EXPECT_FALSE(take->playing);
    EXPECT_EQ(take->mode, Animation::kPingPong);
    EXPECT_EQ(take->speed, -2);
    EXPECT_EQ(take->time, 0.5);
    ASSERT_EQ(take->channels.size(), 3u);
    const auto frames = [&](std::size_t i) { return aspect->get<KeyFrames>(take->channels[i]); };
    EXPECT_TRUE(aspect->find(frames(0)->target).is<Transform>());
    EXPECT_TRUE(aspect->find(frames(1)->target).is<PointLight>()) << "what the transform does not have, the light has";
    EXPECT_EQ(frames(1)->interpolation, KeyFrames::kStep);
    EXPECT_TRUE(aspect->find(frames(2)->target).is<Material>());
    EXPECT_EQ(frames(2)->values.sizeBytes(), 48u);
}

TEST(AnimationText, WhatIsUnsoundIsRefusedWithItsPlace) {
    isRefusedChannel("target: \"lam\" field: \"intensity\" time: 0 value: 1");
    isRefusedChannel("field: \"intensity\" time: 0 value: 1");
    isRefusedChannel("material: \"blue\" field: \"roughness\" time: 0 value: 1");
    isRefusedChannel("target: \"lamp\" field: \"intensty\" time: 0 value: 1");
    isRefusedChannel("target: \"lamp\" field: \"intensity\"");
    isRefusedChannel("target: \"lamp\" field: \"intensity\" time: [1, 0] value: [1, 1]");
    isRefusedChannel("target: \"lamp\" field: \"intensity\" time: [0, 1] value: 1");
    isRefusedChannel("target: \"lamp\" field: \"intensity\" time: nan value: 1");
    isRefusedChannel("target: \"lamp\" field: \"intensity\" time: 0 value: -1");
    isRefusedChannel("target: \"lamp\" field: \"intensity\" time: 2e9 value: 1");
    isRefusedChannel("target: \"lamp\" field: \"name\" time: 0 value: 1");
    const Expected<ImportedScene> none = movingScene("node { animation {} }");
    ASSERT_FALSE(none);
    EXPECT_WORDS(none.error().message);
}

TEST(AnimationText, ANodeThatWasSavedCanBeDrivenAsANode) {
    const Scratch scratch;
    scratch.write(
        "saved.tsct",
        "saved { root: 1 object { number: 1 child: 2 node {} } object { number: 2 node { name: \"old\" } } }");
    const auto driving = [&](const std::string& channel) {
        return importScene(
            scratch.write("moving.tsct", "node { name: \"in\" import { uri: \"saved.tsct\" } }\n" + kLamp +
                                             "node { name: \"take\" animation { channel { target: \"/in/old\" " +
                                             channel + " } } }"),
            kRootNode, importOptions());
    };
    const Expected<ImportedScene> wrong = driving("field: \"intensity\" time: 0 value: 1");
    ASSERT_FALSE(wrong);
    EXPECT_WORDS(wrong.error().message);
    Expected<ImportedScene> scene = driving("field: \"levels\" time: 0 value: 1");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect->get<KeyFrames>(aspect.core<Animation>("/take")->channels[0])->target,
              *findNode(*aspect, "/in/old"));
}

const std::string kStrip = R"(mesh { name: "strip" position: [0,0,0, 1,0,0, 0,1,0, 1,1,0] index: [0,1,2, 1,3,2] }
node { name: "arm" transform { translation { x: 1 } } node { name: "hand" transform { translation { y: 3 } } } }
)";

TEST(SkinText, HasJointsWeightsAndTargetsAndThePoseThatItStandsIn) {
    Expected<ImportedScene> scene = movingScene(
        kStrip +
        R"(node { name: "skin" transform { translation { z: 2 } } skin { mesh: "strip" joint: ["/arm", "/arm/hand"]
  joint_index: [0,0,0,0, 0,0,0,0, 1,0,0,0, 1,0,0,0] joint_weight: [1,0,0,0, 1,0,0,0, 1,0,0,0, 1,0,0,0]
  morph_position: [0,0,1, 0,0,0, 0,0,0, 0,0,0] weight: 0.5 } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* skin = aspect.core<Skin>("/skin/skin");
    ASSERT_NE(skin, nullptr);
    EXPECT_EQ(skin->joints, (RefList{*findNode(*aspect, "/arm"), *findNode(*aspect, "/arm/hand")}));
    const MeshArrays arrays = drawableOf(Object::of(*skin)).arrays();
    const auto p = arrays.positions.as<float>();
    // Below the bearer at z = 2: the first vertex is morphed by half a unit and carried to x = 1, the third goes with
    // the hand.
    EXPECT_TRUE(std::ranges::equal(p, std::vector<float>{1, 0, -1.5f, 2, 0, -2, 1, 4, -2, 2, 4, -2}));
}

TEST(SkinText, WhatCannotBeOneIsRefusedWithItsPlace) {
    const auto says = [](const std::string& skin) {
        const Expected<ImportedScene> scene = movingScene(kStrip + "node { name: \"skin\" skin { " + skin + " } }");
        ASSERT_FALSE(scene) << skin;
        EXPECT_WORDS(scene.error().message);
    };
    const std::string indices = "joint_index: [0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,0] ",
                      weights = "joint_weight: [1,0,0,0, 1,0,0,0, 1,0,0,0, 1,0,0,0] ";
    says("mesh: \"stripe\"");
    says("mesh: \"strip\" joint: \"leg\" " + indices + weights);
    says("mesh: \"strip\" joint: [\"arm\", \"arm\"] " + indices + weights);
    says("mesh: \"strip\" " + indices + weights);
    says("mesh: \"strip\" joint: \"arm\" " + indices);
    says("mesh: \"strip\" joint: \"arm\" joint_index: [0, 0] " + weights);
    says("mesh: \"strip\" joint: \"arm\" joint_index: [1,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,0] " + weights);
    says("mesh: \"strip\" joint: \"arm\" " + indices + "joint_weight: [1,0,0,0, 1,0,0,0, 0,0,0,0, 1,0,0,0]");
    says("mesh: \"strip\" joint: \"arm\" " + indices + "joint_weight: [1,0,0,0, -1,0,0,0, 1,0,0,0, 1,0,0,0]");
    says("mesh: \"strip\" joint: \"arm\" inverse_bind: [1, 2, 3] " + indices + weights);
    says("mesh: \"strip\" morph_position: [1, 2, 3] weight: 1");
    says("mesh: \"strip\" morph_position: [1,2,3, 1,2,3, 1,2,3, 1,2,3] weight: [1, 2]");
}

/// A triangle with eight influences a vertex, as bytes, one vertex without any.
TEST(GltfSkin, KeepsTheFourStrongestOfManyJointsAndFollowsTheFirstWhereNoneIsSaid) {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const int joints0 = gltf.add(std::vector<std::uint8_t>{0, 1, 2, 3, 0, 0, 0, 0, 1, 0, 0, 0}, 5121, "VEC4", 3);
    const int weights0 = gltf.add(std::vector<std::uint8_t>{51, 10, 30, 40, 0, 0, 0, 0, 255, 0, 0, 0}, 5121, "VEC4", 3,
                                  ",\"normalized\":true");
    const int joints1 = gltf.add(std::vector<std::uint16_t>{4, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5123, "VEC4", 3);
    const int weights1 = gltf.add(std::vector<std::uint16_t>{65535, 1000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5123, "VEC4",
                                  3, ",\"normalized\":true");
    std::string nodes;
    for (int i = 0; i < 6; ++i) nodes += fmt::format(R"(,{{"name":"j{}","translation":[{},0,0]}})", i, i);
    const std::string text = gltf.text(fmt::format(
        R"("scenes":[{{"nodes":[0,1,2,3,4,5,6]}}],"nodes":[{{"name":"n","mesh":0,"skin":0}}{}],
        "skins":[{{"joints":[1,2,3,4,5,6]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"JOINTS_0":{},"WEIGHTS_0":{},"JOINTS_1":{},
        "WEIGHTS_1":{}}}}}]}}])",
        nodes, positions, joints0, weights0, joints1, weights1));
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write("many.gltf", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    for (const std::string& note : scene->notes) EXPECT_WORDS(note);
    const ImportedAspect aspect(std::move(*scene));
    const auto* skin = aspect.core<Skin>("/many/n/part 0");
    ASSERT_NE(skin, nullptr);
    EXPECT_TRUE(
        std::ranges::equal(skin->jointIndices.as<std::uint16_t>().first(4), std::vector<std::uint16_t>{4, 0, 3, 2}))
        << "strongest first";
    EXPECT_EQ(skin->jointWeights.as<float>()[0], 1.0f);
    EXPECT_EQ(skin->jointWeights.as<float>()[1], 51.0f / 255);
    EXPECT_EQ(skin->jointWeights.as<float>()[4], 1.0f);
    const double sum = 255 + 51 + 40 + 30;
    EXPECT_NEAR(drawableOf(Object::of(*skin)).arrays().positions.as<float>()[0], (4 * 255 + 3 * 40 + 2 * 30) / sum,
                1e-5);
}

TEST(GltfSkin, WithoutItsJointIsRefusedByName) {
    GltfText gltf;
    const int positions = gltf.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const int joints = gltf.add(std::vector<std::uint8_t>{0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC4", 3);
    const int weights = gltf.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4", 4);
    const auto refused = [&](const char* skin) {
        const Scratch scratch;
        const Expected<ImportedScene> scene = importScene(
            scratch.write("bad.gltf", gltf.text(fmt::format(
                                          R"("scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0,"skin":0}},{{"name":"j"}},
                    {{"name":"elsewhere"}}],"skins":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"JOINTS_0":{},"WEIGHTS_0":{}}}}}]}}])",
                                          skin, positions, joints, weights))),
            kRootNode, importOptions());
        return scene ? std::string("taken") : scene.error().message;
    };
    EXPECT_WORDS(refused(R"({"joints":[1]})"));
    EXPECT_WORDS(refused(R"({"joints":[2]})"));
    EXPECT_WORDS(refused(R"({"joints":[77]})"));
    EXPECT_WORDS(refused(R"({"joints":[1,1]})"));
}

}  // namespace
}  // namespace tessera
