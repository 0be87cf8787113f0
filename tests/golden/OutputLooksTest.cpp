// What outputs look like: a stored picture through each way of packing two eyes, a blend, a warp and colours, beside
// stored results. The values are held against formulas in tests/unit/output; here a change of anybody's looks is seen.
// Who means one: TESSERA_WRITE_PICTURES=1 bin/golden --gtest_filter='*OutputLooks*', and look at them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "client/output/OutputMaker.h"

namespace tessera::test {
namespace {

constexpr int kEyeWidthPx = 240, kEyeHeightPx = 134;

struct OutputLook {
    const char* name;
    void (*set)(TileOutput&);
};
template <StereoPacking packing>
void pack(TileOutput& out) {
    out.stereo = packing;
}
void blend(TileOutput& out) {
    out.blend = true;
    out.black = 0.02;
}
void warp(TileOutput& out) {
    WarpMesh mesh{.columns = 17, .rows = 9, .nodes = {}};
    for (int row = 0; row < mesh.rows; ++row) {
        for (int column = 0; column < mesh.columns; ++column) {
            const float u = static_cast<float>(column) / 16, v = static_cast<float>(row) / 8, x = 2 * u - 1,
                        y = 2 * v - 1;
            mesh.nodes.push_back({.x = x * (1 - 0.1f * y * y),
                                  .y = y * (0.8f + 0.15f * x * x),
                                  .u = u,
                                  .v = v,
                                  .intensity = 1 - 0.4f * u});
        }
    }
    out.warp = std::make_shared<const WarpMesh>(mesh);
}
void colour(TileOutput& out) {
    out.gain = {1, 0.8, 0.5};
    out.gamma = {2.2, 2.0, 2.6};
}

const OutputLook kLooks[] = {{"side-by-side", pack<StereoPacking::kSideBySide>},
                             {"side-by-side-full", pack<StereoPacking::kSideBySideFull>},
                             {"top-bottom", pack<StereoPacking::kTopBottom>},
                             {"top-bottom-full", pack<StereoPacking::kTopBottomFull>},
                             {"anaglyph", pack<StereoPacking::kAnaglyph>},
                             {"anaglyph-plain", pack<StereoPacking::kAnaglyphPlain>},
                             {"rows", pack<StereoPacking::kRows>},
                             {"columns", pack<StereoPacking::kColumns>},
                             {"checkerboard", pack<StereoPacking::kCheckerboard>},
                             {"blend", blend},
                             {"warp", warp},
                             {"colour", colour}};

class OutputLooks : public testing::TestWithParam<OutputLook> {};

TEST_P(OutputLooks, AreAsTheyWere) {
    const std::string folder = TESSERA_SOURCE_DIR "/tests/golden/pictures/";
    const auto stored = [&](const std::string& name) {
        const auto bytes = readFile(folder + name + ".png", std::size_t{1} << 24);
        return bytes ? decodePng(*bytes) : Expected<DecodedPng>(fail(ErrorCode::kNotFound, name));
    };
    const auto hall = stored("engine-hall");
    ASSERT_TRUE(hall);
    Wall wall;
    Screen screen{.name = "s", .lowerLeft = {-1.6, 0.6, 0}, .lowerRight = {1.6, 0.6, 0}, .upperLeft = {-1.6, 2.4, 0}};
    TileOutput output;
    GetParam().set(output);
    const bool stereo = output.stereo != StereoPacking::kNone;
    screen.grid = {.columns = stereo ? 1 : 2,
                   .rows = 1,
                   .tileWidthPx = kEyeWidthPx,
                   .tileHeightPx = kEyeHeightPx,
                   .overlapXPx = stereo ? 0 : 80};
    wall.screens = {screen};
    wall.users = {User{.name = "u"}};
    if (stereo)
        wall.hosts = {{.name = "h",
                       .tiles = {{.screen = "s", .eye = Eye::kLeft, .user = "u", .output = output},
                                 {.screen = "s", .eye = Eye::kRight, .user = "u"}}}};
    else
        wall.hosts = {{.name = "h",
                       .tiles = {{.screen = "s", .user = "u", .output = output},
                                 {.screen = "s", .column = 1, .user = "u", .output = output}}}};
    ASSERT_FALSE(findWallFault(wall)) << findWallFault(wall)->message;

    // The right eye sees the hall from further to the right.
    std::vector<std::vector<std::uint8_t>> eyes;
    std::vector<const std::uint8_t*> starts;
    auto maker = OutputMaker::make(wall, outputsOf(wall, layoutTiles(wall))[0].name).value();
    for (std::size_t eye = 0; eye < maker.tiles().size(); ++eye) {
        Picture part = Picture::filled(kEyeWidthPx, kEyeHeightPx, 0, 0, 0);
        paste(part, hall->picture, -100 - 12 * static_cast<int>(eye), -60);
        eyes.emplace_back();
        for (std::size_t i = 0; i < part.rgb.size(); i += 3)
            eyes.back().insert(eyes.back().end(), {part.rgb[i], part.rgb[i + 1], part.rgb[i + 2], 255});
    }
    for (const auto& eye : eyes) starts.push_back(eye.data());
    Picture picture = Picture::filled(maker.widthPx(), maker.heightPx(), 0, 0, 0);
    dropAlpha(maker.draw(starts), picture.rgb.size() / 3, picture.rgb.data());

    const std::string name = std::string("output-") + GetParam().name;
    if (std::getenv("TESSERA_WRITE_PICTURES")) {
        ASSERT_TRUE(writeFile(folder + name + ".png", encodePng(picture, std::nullopt)));
        return;
    }
    const auto expected = stored(name);
    ASSERT_TRUE(expected && expected->picture.widthPx == picture.widthPx &&
                expected->picture.heightPx == picture.heightPx)
        << name;
    // Another library of mathematics may round a table's value otherwise.
    int most = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); ++i)
        most = std::max(most, std::abs(picture.rgb[i] - expected->picture.rgb[i]));
    EXPECT_LE(most, 1) << name << " looks another way";
}

INSTANTIATE_TEST_SUITE_P(OfOneHall, OutputLooks, testing::ValuesIn(kLooks), [](const auto& info) {
    std::string name = info.param.name;
    std::erase(name, '-');
    return name;
});

}  // namespace
}  // namespace tessera::test
