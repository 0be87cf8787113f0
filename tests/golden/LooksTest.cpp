// What the shipped scenes look like: beside stored pictures, with a tolerance, so that nobody changes everybody's looks
// unseen. Who means to: TESSERA_WRITE_PICTURES=1 bin/golden --gtest_filter='*Looks*', and look at them.
#include <cstdlib>
#include <filesystem>

#include "tests/golden/ShippedScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

constexpr int kWidthPx = 480, kHeightPx = 270;

struct Difference {
    double mean = 0;   ///< of all bytes
    double share = 0;  ///< of pixels that anybody would call another colour
};

Difference between(const Picture& a, const Picture& b) {
    Difference out;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        int most = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const int apart = std::abs(a.rgb[i + c] - b.rgb[i + c]);
            out.mean += apart;
            most = std::max(most, apart);
        }
        constexpr int kAnotherColour = 16;
        out.share += most > kAnotherColour;
    }
    out.mean /= static_cast<double>(a.rgb.size());
    out.share /= static_cast<double>(a.rgb.size() / 3);
    return out;
}

/// Other processors round otherwise, here and there.
bool alike(const Difference& d) {
    return d.mean < 0.3 && d.share < 2e-3;
}

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
    const Expected<Bytes> bytes = readFile(stored, std::size_t{1} << 24);
    ASSERT_TRUE(bytes) << bytes.error().message;
    const Expected<DecodedPng> expected = decodePng(*bytes);
    ASSERT_TRUE(expected && expected->picture.rgb.size() == picture.rgb.size()) << stored;
    const Difference difference = between(picture, expected->picture);
    if (!alike(difference)) {
        const std::string now = testing::TempDir() + "/" + name + ".png";
        ASSERT_TRUE(writeFile(now, encodePng(picture, std::nullopt)));
        ADD_FAILURE() << name << " looks another way: bytes differ by " << difference.mean << " in the mean, "
                      << 100 * difference.share << " % of the pixels are of another colour. Now " << now << ", stored "
                      << stored;
    }
    // A tolerance that takes anything would show nothing: one thing less, or all a little darker, is seen.
    Picture darker = picture;
    for (std::uint8_t& byte : darker.rgb) byte = static_cast<std::uint8_t>(byte * 99 / 100);
    EXPECT_FALSE(alike(between(darker, expected->picture)));
    Picture less = picture;
    paste(less, Picture::filled(24, 24, 128, 64, 128), kWidthPx / 2, kHeightPx / 2);
    EXPECT_FALSE(alike(between(less, expected->picture)));
}

INSTANTIATE_TEST_SUITE_P(OfShippedScenes, Looks,
                         testing::Values("engine-hall", "engine-apart", "chess", "city", "hall-by-hand", "scan", "subdivision", "rearing", "turbine", "bent", "materials", "lights", "groups", "letters", "moving",
                                         "plant", "pour-1000", "pour-10000"),
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
