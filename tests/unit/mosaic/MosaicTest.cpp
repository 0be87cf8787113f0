#include "common/mosaic/Mosaic.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

/// Two screens: 2x2 tiles of uneven size with bezels, and a single tile that is less high.
Wall twoScreens() {
    Wall wall = test::oneByOne();
    Screen& front = wall.screens[0];
    front.grid = {
        .columns = 2, .rows = 2, .tileWidthPx = 5, .tileHeightPx = 4, .columnWidthsPx = {5, 4}, .rowHeightsPx = {4, 3}};
    Screen side = front;
    side.name = "side";
    side.grid = {.columns = 1, .rows = 1, .tileWidthPx = 6, .tileHeightPx = 2};
    wall.screens.push_back(side);
    wall.hosts[0].tiles.clear();
    for (int column = 0; column < 2; ++column)
        for (int row = 0; row < 2; ++row) wall.hosts[0].tiles.push_back({"front", column, row, Eye::kCenter, "viewer"});
    wall.hosts[0].tiles.push_back({"side", 0, 0, Eye::kCenter, "viewer"});
    return wall;
}

answer::Images imagesOf(const Wall& wall) {
    answer::Images images;
    for (const Tile& tile : layoutTiles(wall)) {
        const auto shade = static_cast<std::uint8_t>(40 * (images.tiles.size() + 1));
        const Picture picture = Picture::filled(tile.mosaicRect.width, tile.mosaicRect.height, shade, 0, 0);
        images.tiles.push_back({tile.name, tile.host, 12_frame, share(encodePng(picture, 12))});
    }
    return images;
}

int redAt(const Picture& picture, int x, int y) {
    return picture.rgb[3 * static_cast<std::size_t>(y * picture.widthPx + x)];
}

TEST(Mosaic, TilesStandWhereTheWallHasThemAndScreensSideBySide) {
    const Wall wall = twoScreens();
    const auto mosaic = stitch(wall, imagesOf(wall));
    ASSERT_TRUE(mosaic) << mosaic.error().message;
    const Picture& picture = mosaic->picture;
    EXPECT_EQ(mosaic->frame, 12_frame);
    EXPECT_TRUE(mosaic->missing.empty());
    ASSERT_EQ(picture.widthPx, 5 + 4 + 6);
    ASSERT_EQ(picture.heightPx, 4 + 3);
    EXPECT_EQ(redAt(picture, 0, 6), 40) << "column 0, row 0: lower left";
    EXPECT_EQ(redAt(picture, 0, 0), 80) << "column 0, row 1: above it";
    EXPECT_EQ(redAt(picture, 4, 3), 40) << "row 0 is four pixels high";
    EXPECT_EQ(redAt(picture, 4, 2), 80);
    EXPECT_EQ(redAt(picture, 5, 6), 120) << "column 1 begins at the sixth pixel";
    EXPECT_EQ(redAt(picture, 8, 0), 160);
    EXPECT_EQ(redAt(picture, 9, 6), 200) << "the second screen";
    EXPECT_EQ(redAt(picture, 14, 5), 200);
    EXPECT_EQ(redAt(picture, 9, 4), 0) << "nothing above a lower screen";
}

TEST(Mosaic, ATileWithoutHostIsBlackAndNamed) {
    const Wall wall = twoScreens();
    answer::Images images = imagesOf(wall);
    const std::string name = images.tiles[1].tile;
    images.tiles.erase(images.tiles.begin() + 1);
    images.missing.push_back(name);
    const auto mosaic = stitch(wall, images);
    ASSERT_TRUE(mosaic);
    EXPECT_EQ(mosaic->missing, std::vector<std::string>{name});
    EXPECT_EQ(redAt(mosaic->picture, 0, 0), 0);
    EXPECT_EQ(stitch(wall, {}).error().code, ErrorCode::kRefused) << "no tile at all is no picture";
}

TEST(Mosaic, TilesOfDifferentFramesAreNoPicture) {
    const Wall wall = twoScreens();
    answer::Images images = imagesOf(wall);
    images.tiles[2].frame = 13_frame;
    const auto mixed = stitch(wall, images);
    ASSERT_FALSE(mixed);
    EXPECT_EQ(mixed.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(mixed.error().message);
}

/// A small file whose head says that it is very large, with the head's sum (PNG, annex D).
TEST(Mosaic, AnImageOfAnotherSizeIsRefusedBeforeItIsUnpacked) {
    Bytes png = encodePng(Picture::filled(8, 8, 1, 2, 3), 12);
    const auto put = [&](std::size_t at, std::uint32_t number) {
        for (std::size_t i = 0; i < 4; ++i) png[at + i] = static_cast<std::byte>(number >> (24 - 8 * i));
    };
    constexpr std::size_t kHead = 12, kWidth = 16, kHeight = 20, kSum = 29;
    put(kWidth, 16'384);
    put(kHeight, 16'384);
    std::uint32_t sum = 0xffff'ffff;
    for (std::size_t at = kHead; at < kSum; ++at) {
        sum ^= std::to_integer<std::uint32_t>(png[at]);
        for (int bit = 0; bit < 8; ++bit) sum = sum & 1 ? 0xedb8'8320U ^ sum >> 1 : sum >> 1;
    }
    put(kSum, ~sum);
    const Wall wall = twoScreens();
    answer::Images images = imagesOf(wall);
    images.tiles[0].png = share(std::move(png));
    const auto refused = stitch(wall, images);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
}

TEST(Mosaic, ImagesThatAreNoneAreRefused) {
    const Wall wall = twoScreens();
    answer::Images images = imagesOf(wall);
    images.tiles[0].png = share(Bytes(10));
    EXPECT_FALSE(stitch(wall, images));
    images.tiles[0].png = images.tiles[4].png;
    EXPECT_WORDS(stitch(wall, images).error().message);
}

}  // namespace
}  // namespace tessera
