// What the shipped scenes look like: beside stored pictures, with a tolerance, so that nobody changes everybody's looks
// unseen. Who means to: TESSERA_WRITE_PICTURES=1 bin/golden --gtest_filter='*Looks*', and look at them.
#include <cstdlib>
#include <filesystem>

#include "tests/golden/PictureDifference.h"
#include "tests/golden/ShippedScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

constexpr int kWidthPx = 480, kHeightPx = 270;

class Looks : public testing::TestWithParam<const char*> {};

TEST_P(Looks, AreAsTheyWere) {
    const std::string name = GetParam();
    const bool hasPlant = name.starts_with("pour") || name == "plant";
    if (hasPlant && !std::filesystem::exists(plantFolder())) GTEST_SKIP() << "the plant is missing (TESSERA_TEST_DATA)";
    if (name.starts_with("engine") && !std::filesystem::exists(kAssimpModels))
        GTEST_SKIP() << "models are missing (Debian package assimp-testmodels)";
    const Expected<Aspect> shipped = loadShipped(name);
    ASSERT_TRUE(shipped) << shipped.error().message;
    RenderScene scene;
    scene.update(*shipped, nullptr);
    const Screen screen = flatScreen(1, 1, kWidthPx, kHeightPx);
    const ScreenCamera camera = screenCamera(screen, User(), Eye::kCenter, cameraOfScene(*shipped));
    Stage stage(4);
    const Picture picture = drawPart(stage, *shipped, scene, CullerKind::kMasked, camera,
                                     {.x = 0, .y = 0, .width = kWidthPx, .height = kHeightPx});
    ASSERT_GT(lookOf(picture).spread, 20) << "a picture of nothing";

    const std::string stored = TESSERA_SOURCE_DIR "/tests/golden/pictures/" + name + ".png";
    if (std::getenv("TESSERA_WRITE_PICTURES")) {
        ASSERT_TRUE(writeFile(stored, encodePng(picture, std::nullopt)));
        return;
    }
    expectNear(picture, stored, name);
}

INSTANTIATE_TEST_SUITE_P(OfShippedScenes, Looks,
                         testing::Values("engine-hall", "engine-apart", "chess", "city", "hall-by-hand", "scan",
                                         "subdivision", "rearing", "turbine", "bent", "materials", "lights", "groups",
                                         "letters", "moving", "gallery", "particles", "volume", "pictures", "gloss",
                                         "techniques", "modes", "emitters", "plant", "pour-1000", "pour-10000"),
                         [](const testing::TestParamInfo<const char*>& scene) {
                             std::string name = scene.param;
                             std::erase(name, '-');
                             return name;
                         });

/// Whoever ships a scene stores what it looks like.
TEST(ShippedScenes, HaveTheirLooksStored) {
    for (const auto& entry : std::filesystem::directory_iterator(TESSERA_SOURCE_DIR "/deploy/scenes")) {
        if (entry.path().extension() != ".tsct") continue;
        EXPECT_TRUE(std::filesystem::exists(TESSERA_SOURCE_DIR "/tests/golden/pictures/" +
                                            entry.path().stem().string() + ".png"))
            << entry.path();
    }
}

}  // namespace
}  // namespace tessera::test
