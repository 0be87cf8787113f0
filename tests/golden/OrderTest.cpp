// One context draws every shipped scene twice, each time after others: the bytes are the same.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "tests/golden/ShippedScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

constexpr int kOrderWidthPx = 320, kOrderHeightPx = 180;

unsigned orderSeed() {
    const char* given = std::getenv("TESSERA_SEED");
    return given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : 1;
}

/// What is drawn in turn.
struct ShownInTurn {
    std::string name;
    std::shared_ptr<const Aspect> aspect;
    std::shared_ptr<const RenderScene> scene;
    View view;
};

void expectTheSameInAnyOrder(std::vector<ShownInTurn> all) {
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(orderSeed()));
    std::mt19937 random(orderSeed());
    Stage stage(4);
    const auto pictureOf = [&](const ShownInTurn& shown, int widthPx) {
        const ScreenCamera camera =
            screenCamera(flatScreen(1, 1, kOrderWidthPx, kOrderHeightPx), User(), Eye::kCenter, shown.view);
        return drawPart(stage, *shown.aspect, *shown.scene, CullerKind::kTwoPhase, camera,
                        {.x = 0, .y = 0, .width = widthPx, .height = kOrderHeightPx});
    };
    std::map<std::string, Picture> first;
    for (const ShownInTurn& shown : all)
        EXPECT_GT(lookOf(first[shown.name] = pictureOf(shown, kOrderWidthPx)).spread, 15) << shown.name;
    std::ranges::shuffle(all, random);
    for (const ShownInTurn& shown : all) {
        // Rows of another length come in between.
        (void)pictureOf(all[random() % all.size()], 7 + static_cast<int>(random() % 60));
        EXPECT_EQ(differingPixels(pictureOf(shown, kOrderWidthPx), first[shown.name]), 0u) << shown.name;
    }
}

class Order : public testing::TestWithParam<std::vector<const char*>> {};

TEST_P(Order, OfShippedScenesChangesNoByte) {
    std::vector<ShownInTurn> all;
    for (const std::string name : GetParam()) {
        if ((name.starts_with("pour") || name == "plant") && !std::filesystem::exists(plantFolder()))
            GTEST_SKIP() << "the plant is missing (TESSERA_TEST_DATA)";
        if (name.starts_with("engine") && !std::filesystem::exists(kAssimpModels))
            GTEST_SKIP() << "models are missing (Debian package assimp-testmodels)";
        Expected<Aspect> shipped = loadShipped(name);
        ASSERT_TRUE(shipped) << name << ": " << shipped.error().message;
        auto scene = std::make_shared<RenderScene>();
        scene->update(*shipped, nullptr);
        const View view = cameraOfScene(*shipped);
        all.push_back({name, std::make_shared<const Aspect>(std::move(*shipped)), std::move(scene), view});
    }
    expectTheSameInAnyOrder(std::move(all));
}

INSTANTIATE_TEST_SUITE_P(
    Shipped, Order,
    testing::Values(std::vector{"engine-hall", "chess", "materials", "lights", "letters", "pictures", "volume"},
                    std::vector{"engine-apart", "hall-by-hand", "groups", "moving", "particles", "gloss", "scan"},
                    std::vector{"subdivision", "rearing", "turbine", "bent", "city"},
                    std::vector{"plant", "pour-1000"}),
    [](const auto& scenes) { return "Group" + std::to_string(scenes.index); });

/// Every third room.
class GalleryOrder : public testing::TestWithParam<std::size_t> {};

TEST_P(GalleryOrder, OfRoomsChangesNoByte) {
    Expected<Aspect> loaded = loadShipped("gallery");
    ASSERT_TRUE(loaded) << loaded.error().message;
    const auto aspect = std::make_shared<const Aspect>(std::move(*loaded));
    auto scene = std::make_shared<RenderScene>();
    scene->update(*aspect, nullptr);
    std::vector<ShownInTurn> all;
    std::size_t rooms = 0;
    for (const auto& entry : std::filesystem::directory_iterator(TESSERA_SOURCE_DIR "/deploy/scenes/gallery"))
        rooms += entry.path().extension() == ".tsct";
    for (std::size_t room = GetParam(); room < rooms; room += 3)
        all.push_back({"room " + std::to_string(room), aspect, scene, viewOfRoom(*aspect, room)});
    expectTheSameInAnyOrder(std::move(all));
}

INSTANTIATE_TEST_SUITE_P(Shipped, GalleryOrder, testing::Range<std::size_t>(0, 3));

}  // namespace
}  // namespace tessera::test
