/// The walls' pictures against one big picture: byte for byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

constexpr std::uint64_t kFrame = 11;  // the carriage drives

/// Not blank: many colours, and no single one nearly everywhere.
void expectContent(const Picture& p) {
    std::map<std::uint32_t, std::size_t> colours;
    for (std::size_t i = 0; i + 2 < p.rgb.size(); i += 3)
        ++colours[static_cast<std::uint32_t>(p.rgb[i] << 16 | p.rgb[i + 1] << 8 | p.rgb[i + 2])];
    std::size_t most = 0;
    for (const auto& [colour, count] : colours) most = std::max(most, count);
    EXPECT_GT(colours.size(), 100u);
    EXPECT_LT(most, p.rgb.size() / 3 * 95 / 100);
}

Picture drawn(const std::string& wall, std::optional<CullerKind> culler = {}) {
    return SimulatedWall({.scene = kYard, .wall = wall, .widthPx = 642, .heightPx = 362, .culler = culler})
        .pictureOf(kFrame);
}

TEST(Oracles, EachWallUnderEachCullerShowsTheOneBigPicture) {
    const Picture one = drawn("1x1", CullerKind::kNone);
    EXPECT_EQ(one.widthPx, 642);
    EXPECT_EQ(one.heightPx, 362);
    expectContent(one);
    EXPECT_TRUE(one == drawn("3x1"));
    for (const CullerKind kind : kAllCullers) EXPECT_TRUE(one == drawn("2x2", kind)) << nameOf(kind);
}

TEST(Oracles, BezelTilesAreCropsOfOnePictureThatGoesOnBehindThem) {
    SimulatedWall bezels({.scene = kYard, .wall = "3x1-bezels", .widthPx = 0});
    const Screen& s = bezels.wall().screens[0];
    // The same screen without frames: one tile of all its pixels.
    const ScreenPixels pixels = screenPixels(s);
    const auto corner = [](const Vec3d& v) { return fmt::format("{{ x: {} y: {} z: {} }}", v.x(), v.y(), v.z()); };
    const User& user = bezels.wall().users[0];
    const test::TestFolder folder;
    const std::string big =
        folder.write("big.wall", "screens { name: \"front\" lower_left " + corner(s.lowerLeft) + " lower_right " +
                                     corner(s.lowerRight) + " upper_left " + corner(s.upperLeft) +
                                     " grid { columns: 1 rows: 1 tile_width_px: " + std::to_string(pixels.width) +
                                     " tile_height_px: " + std::to_string(pixels.height) +
                                     " } }\nusers { name: \"viewer\" position " + corner(user.position) +
                                     " }\nhosts { name: \"all\" tiles { screen: \"front\" user: \"viewer\" } }\n");
    const Picture all = SimulatedWall({.scene = kYard, .wall = big, .widthPx = 0}).pictureOf(kFrame);
    ASSERT_EQ(all.widthPx, pixels.width);
    (void)bezels.pictureOf(kFrame);
    for (const Tile& tile : layoutTiles(bezels.wall())) {
        Picture crop = Picture::filled(tile.rect.width, tile.rect.height, 0, 0, 0);
        paste(crop, all, -tile.rect.x, -(pixels.height - tile.rect.y - tile.rect.height));
        EXPECT_TRUE(bezels.tilePicture(tile.name) == crop) << tile.name;
    }
}

std::vector<std::string> shippedWalls() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(TESSERA_SOURCE_DIR "/deploy/walls"))
        if (entry.path().extension() == ".wall") names.push_back(entry.path().stem());
    std::ranges::sort(names);
    return names;
}
class ShippedWall : public testing::TestWithParam<std::string> {};

TEST_P(ShippedWall, IsDrawnWithoutFaults) {
    const bool asItIs = GetParam() == "3x1-bezels";
    AskedWall wall({.wall = GetParam(), .scene = kYard, .widthPx = asItIs ? 0 : 480, .heightPx = 270});
    ASSERT_TRUE(wall.waitForFrame(kFrame)) << wall.logs();
    expectContent(wall.settledPicture());
    for (const Tile& tile : layoutTiles(wall.wall())) EXPECT_GT(wall.tilePicture(tile.name).widthPx, 0) << tile.name;
    const nlohmann::json report = wall.finish();
    EXPECT_EQ(report["sync"]["worst_skew_frames"], 0);
    EXPECT_GE(report["sync"]["widest_swap"]["ms"], 0);
    EXPECT_LT(report["sync"]["widest_swap"]["frame"], report["frames"]);
    for (const nlohmann::json& tile : report["tiles"]) EXPECT_EQ(tile["shown"], report["frames"]) << tile.dump(2);
}

INSTANTIATE_TEST_SUITE_P(Every, ShippedWall, testing::ValuesIn(shippedWalls()), [](const auto& info) {
    std::string name = info.param;
    std::ranges::replace_if(
        name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
    return name;
});

TEST(Oracles, ContactsReachTheReport) {
    AskedWall wall({.wall = "1x1", .scene = kYard, .widthPx = 64, .heightPx = 36});
    ASSERT_TRUE(wall.waitForFrame(60)) << wall.logs();
    const nlohmann::json report = wall.finish();
    EXPECT_GE(report["collision"]["contacts"].get<int>(), 1);
    ASSERT_FALSE(report["collision"]["contact_list"].empty());
    const nlohmann::json& contact = report["collision"]["contact_list"][0];
    EXPECT_EQ(contact["objects"][1].get<std::string>().rfind("/post", 0), 0u) << contact.dump();
    EXPECT_NEAR(contact["normal"][0].get<double>(), 1, 1e-6);
}

}  // namespace
}  // namespace tessera::simulation
