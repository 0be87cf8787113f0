/// What scene text says of material groups, levels of detail, billboards, applications' data, and of lights beside
/// their colours.
#include <gtest/gtest.h>

#include "common/cores/ApplicationData.h"
#include "common/cores/Billboard.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Material.h"
#include "common/cores/MaterialGroup.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Switch.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importGroups(const std::string& text) {
    const Scratch scratch;
    return importScene(scratch.write("groups.tsct", text), kRootNode, importOptions());
}

std::string groupsTrouble(const std::string& text) {
    const Expected<ImportedScene> scene = importGroups(text);
    return scene ? "" : scene.error().message;
}

TEST(GroupsText, ASwitchShowsSeveral) {
    Expected<ImportedScene> scene =
        importGroups(R"(node { name: "some" switch { shown: [0, 2, 62] } node { name: "a" } node { name: "b" } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect.core<Switch>("/some")->choice, Switch::kMask);
    EXPECT_EQ(aspect.core<Switch>("/some")->mask, (std::int64_t{1} << 62) + 5);
    for (const char* wrong : {"node { switch { shown: [63] } }", "node { switch { choice: 1 shown: [2] } }",
                              "node { switch { choice: -3 } }"})
        EXPECT_FALSE(importGroups(wrong)) << wrong;
}

TEST(GroupsText, KeepsWhatApplicationsDeclare) {
    Expected<ImportedScene> scene =
        importGroups(R"(node { name: "hall" node { name: "score" application_data { key: "org.example.score" )"
                     R"(data: "17\000!" } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* data = aspect.core<ApplicationData>("/hall/score");
    ASSERT_NE(data, nullptr);
    EXPECT_EQ(data->key, "org.example.score");
    const std::span<const char> bytes = data->data.as<char>();
    EXPECT_EQ(std::string(bytes.begin(), bytes.end()), std::string("17\0!", 4));
    EXPECT_WORDS(groupsTrouble(R"(node { application_data { data: "17" } })"));
}

TEST(GroupsText, LevelsWithoutAnyAreNoted) {
    const Expected<ImportedScene> scene = importGroups("node { distance_lod { range: 1 range: 2 } }");
    ASSERT_TRUE(scene) << messageOf(scene);
    ASSERT_EQ(scene->notes.size(), 1u);
    EXPECT_WORDS(scene->notes[0]);
}

TEST(GroupsText, HoldsMaterialGroupsLevelsAndBillboards) {
    Expected<ImportedScene> scene = importGroups(R"(
        material { name: "gilt" metallic: 1 }
        node { name: "lent" transform { translation { x: 1 } }
          material_group { material: "gilt" override: true protect: true }
          node { name: "thing" box { size { x: 1 y: 1 z: 1 } } } }
        node { name: "tree" distance_lod { range: 5 range: 12.5 center { y: 2 } hysteresis: 0.2 } node {} node {}
          node {} }
        node { name: "pixels" distance_lod { range: 90 range: 20 measure: SIZE radius: 3 } node {} node {} node {} }
        node { name: "sign" transform { translation { x: 1 } } billboard { axis { x: 1 } } node { name: "plate" } }
        node { name: "post" billboard {} }
        node { name: "point" billboard { point: true } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    // Below a transform the core has a node of its own, which holds what the text writes below.
    const auto* group = aspect.core<MaterialGroup>("/lent/material_group");
    ASSERT_NE(group, nullptr);
    ASSERT_NE(aspect->get<Material>(group->material), nullptr);
    EXPECT_EQ(aspect->get<Material>(group->material)->metallic, 1.0f);
    EXPECT_TRUE(group->overrides && group->protects);
    EXPECT_TRUE(findNode(*aspect, "/lent/material_group/thing"));
    const auto* tree = aspect.core<DistanceLOD>("/tree");
    ASSERT_NE(tree, nullptr);
    ASSERT_EQ(tree->ranges.as<double>().size(), 2u);
    EXPECT_EQ(tree->ranges.as<double>()[1], 12.5);
    EXPECT_EQ(tree->center, Vec3d(0, 2, 0));
    EXPECT_EQ(tree->hysteresis, 0.2);
    const auto* pixels = aspect.core<DistanceLOD>("/pixels");
    EXPECT_EQ(pixels->measure, DistanceLOD::kSize);
    EXPECT_EQ(pixels->radius, 3);
    EXPECT_EQ(pixels->hysteresis, DistanceLOD().hysteresis);
    EXPECT_EQ(aspect.core<Billboard>("/sign/billboard")->axis, Vec3d::UnitX());
    EXPECT_TRUE(findNode(*aspect, "/sign/billboard/plate"));
    EXPECT_EQ(aspect.core<Billboard>("/post")->axis, Vec3d::UnitY());
    EXPECT_EQ(aspect.core<Billboard>("/point")->axis, Vec3d::Zero());
}

TEST(GroupsText, LightsStandAtBeaconsFallOffAndAreOff) {
    Expected<ImportedScene> scene = importGroups(R"(
        node { name: "arm" node { name: "tip" } }
        node { name: "lamp" point_light { beacon: "/arm/tip" attenuation { x: 1 y: 2 z: 3 } on: false } }
        node { name: "beam" spot_light { beacon: "arm" } }
        node { name: "sun" directional_light { beacon: "/arm" } }
        node { name: "bulb" point_light {} })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* lamp = aspect.core<PointLight>("/lamp");
    EXPECT_EQ(lamp->beacon, *findNode(*aspect, "/arm/tip"));
    EXPECT_EQ(lamp->attenuation, Vec3f(1, 2, 3));
    EXPECT_FALSE(lamp->on);
    EXPECT_EQ(aspect.core<SpotLight>("/beam")->beacon, *findNode(*aspect, "/arm"));
    EXPECT_EQ(aspect.core<DirectionalLight>("/sun")->beacon, *findNode(*aspect, "/arm"));
    const auto* bulb = aspect.core<PointLight>("/bulb");
    EXPECT_TRUE(bulb->on && !bulb->beacon);
    EXPECT_EQ(bulb->attenuation, Vec3f(0, 0, 1));
    EXPECT_TRUE(!bulb->scope && !bulb->outside);
}

TEST(GroupsText, LightsLightWhatIsBelowANodeOrAllTheRest) {
    Expected<ImportedScene> scene = importGroups(R"(
        node { name: "room" node { name: "table" }
          node { name: "lamp" point_light { scope: "table" beacon: "/room" } } }
        node { name: "beam" spot_light { scope: "/room" outside: true } }
        node { name: "sun" directional_light { scope: "/room/table" } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* lamp = aspect.core<PointLight>("/room/lamp");
    EXPECT_EQ(lamp->scope, *findNode(*aspect, "/room/table"));
    EXPECT_EQ(lamp->beacon, *findNode(*aspect, "/room"));
    EXPECT_FALSE(lamp->outside);
    EXPECT_EQ(aspect.core<SpotLight>("/beam")->scope, *findNode(*aspect, "/room"));
    EXPECT_TRUE(aspect.core<SpotLight>("/beam")->outside);
    EXPECT_EQ(aspect.core<DirectionalLight>("/sun")->scope, *findNode(*aspect, "/room/table"));
    EXPECT_WORDS(groupsTrouble("\nnode { directional_light { scope: \"nowhere\" } }"));
}

TEST(GroupsText, SaysWhatIsWrong) {
    EXPECT_WORDS(groupsTrouble(R"(node { material_group { material: "gold" } })"));
    EXPECT_WORDS(groupsTrouble(R"(node { distance_lod { range: 5 range: 4 } })"));
    EXPECT_WORDS(groupsTrouble(R"(node { distance_lod { range: nan } })"));
    EXPECT_WORDS(groupsTrouble(R"(node { distance_lod { hysteresis: 2 } })"));
    EXPECT_WORDS(groupsTrouble(R"(node { billboard { point: true axis { x: 1 } } })"));
    EXPECT_WORDS(groupsTrouble("\nnode { point_light { beacon: \"nowhere\" } }"));
    EXPECT_WORDS(groupsTrouble(R"(node { point_light { attenuation { x: -1 } } })"));
    const Expected<ImportedScene> few = importGroups(R"(node { distance_lod { range: 5 range: 9 } node {} })");
    ASSERT_TRUE(few) << messageOf(few);
    ASSERT_EQ(few->notes.size(), 1u);
    EXPECT_WORDS(few->notes[0]);
}

}  // namespace
}  // namespace tessera
