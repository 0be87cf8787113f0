#include <gtest/gtest.h>

#include <numeric>

#include "common/wall/Wall.h"
#include "tests/unit/wall/SampleWalls.h"

namespace tessera {
namespace {

using test::caveWall;
using test::flatWall;

const Tile& tileAt(const std::vector<Tile>& tiles, int column, int row) {
    for (const Tile& tile : tiles) {
        if (tile.column == column && tile.row == row) return tile;
    }
    ADD_FAILURE() << "no tile " << column << " " << row;
    return tiles.front();
}

TEST(TileLayout, CountsColumnsFromTheLeftAndRowsFromTheBottom) {
    const std::vector<Tile> tiles = layoutTiles(flatWall(2, 2));
    ASSERT_EQ(tiles.size(), 4u);
    EXPECT_EQ(tileAt(tiles, 0, 0).rect, (PixelRect{0, 0, 960, 540}));
    EXPECT_EQ(tileAt(tiles, 1, 0).rect, (PixelRect{960, 0, 960, 540}));
    EXPECT_EQ(tileAt(tiles, 0, 1).rect, (PixelRect{0, 540, 960, 540}));
    EXPECT_EQ(tileAt(tiles, 1, 1).rect, (PixelRect{960, 540, 960, 540}));
    for (const Tile& tile : tiles)
        EXPECT_EQ(tile.rect, tile.mosaicRect) << "without bezels there is nothing to leave out";
}

TEST(TileLayout, NamesTilesAfterScreenColumnRowAndEye) {
    Wall wall = flatWall(2, 1);
    wall.hosts[1].tiles[0].eye = Eye::kLeft;
    wall.hosts[1].tiles.push_back(wall.hosts[1].tiles[0]);
    wall.hosts[1].tiles[1].eye = Eye::kRight;
    ASSERT_TRUE(checkWall(wall));
    const std::vector<Tile> tiles = layoutTiles(wall);
    ASSERT_EQ(tiles.size(), 3u);
    EXPECT_EQ(tiles[0].name, "front-0-0");
    EXPECT_EQ(tiles[1].name, "front-1-0-left");
    EXPECT_EQ(tiles[2].name, "front-1-0-right");
    EXPECT_EQ(tiles[1].rect, tiles[2].rect);
    EXPECT_EQ(tilesOf(wall, "host-1-0").size(), 2u);
    EXPECT_EQ(tilesOf(wall, "host-0-0").size(), 1u);
    EXPECT_TRUE(tilesOf(wall, "nobody").empty());
}

TEST(TileLayout, LetsThePictureGoOnBehindBezels) {
    Wall wall = flatWall(3, 2, 1920, 1080);
    wall.screens[0].grid.bezelXPx = 40;
    wall.screens[0].grid.bezelYPx = 30;
    const std::vector<Tile> tiles = layoutTiles(wall);
    EXPECT_EQ(tileAt(tiles, 2, 1).rect, (PixelRect{2 * 680, 570, 640, 540}));
    EXPECT_EQ(tileAt(tiles, 2, 1).mosaicRect, (PixelRect{2 * 640, 540, 640, 540}));
    EXPECT_EQ(screenPixels(wall.screens[0]).width, 2000);
    EXPECT_EQ(screenPixels(wall.screens[0]).height, 1110);
    EXPECT_EQ(mosaicPixels(wall.screens[0]).width, 1920);
    EXPECT_EQ(mosaicPixels(wall.screens[0]).height, 1080);
}

TEST(TileLayout, LetsBlendedProjectorsShareTheirOverlap) {
    Wall wall = flatWall(3, 1, 1920, 1080);
    wall.screens[0].grid.overlapXPx = 64;
    const std::vector<Tile> tiles = layoutTiles(wall);
    EXPECT_EQ(tileAt(tiles, 1, 0).rect, (PixelRect{576, 0, 640, 1080}));
    EXPECT_EQ(tileAt(tiles, 2, 0).rect, (PixelRect{1152, 0, 640, 1080}));
    EXPECT_EQ(screenPixels(wall.screens[0]).width, 1792);
    EXPECT_EQ(mosaicPixels(wall.screens[0]).width, 1792);
    EXPECT_EQ(tileAt(tiles, 2, 0).mosaicRect, tileAt(tiles, 2, 0).rect) << "shared pixels stand in the mosaic once";
}

TEST(WallWithSize, GivesExactlyThePixelsAskedForOddOnesToo) {
    for (const auto& [columns, rows] : {std::pair{1, 1}, {2, 2}, {3, 1}, {5, 4}}) {
        for (const auto& [width, height] : {std::pair{1920, 1080}, {641, 479}, {1003, 7}, {5, 4}}) {
            const Expected<Wall> sized = withSize(flatWall(columns, rows), width, height);
            ASSERT_TRUE(sized) << sized.error().message;
            EXPECT_EQ(mosaicPixels(sized->screens[0]).width, width);
            EXPECT_EQ(mosaicPixels(sized->screens[0]).height, height);
            // The tiles cover the picture once: every pixel of it belongs to one tile.
            std::vector<int> covered(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
            for (const Tile& tile : layoutTiles(*sized)) {
                for (int y = 0; y < tile.rect.height; ++y) {
                    for (int x = 0; x < tile.rect.width; ++x)
                        ++covered[static_cast<std::size_t>((tile.rect.y + y) * width + tile.rect.x + x)];
                }
            }
            EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), static_cast<long>(covered.size()));
        }
    }
}

TEST(WallWithSize, GivesTheOddRestToTheFirstColumnsAndRows) {
    const Wall sized = *withSize(flatWall(3, 2), 641, 479);
    const std::vector<Tile> tiles = layoutTiles(sized);
    EXPECT_EQ(tileAt(tiles, 0, 0).rect, (PixelRect{0, 0, 214, 240}));
    EXPECT_EQ(tileAt(tiles, 1, 0).rect, (PixelRect{214, 0, 214, 240}));
    EXPECT_EQ(tileAt(tiles, 2, 1).rect, (PixelRect{428, 240, 213, 239}));
    EXPECT_TRUE(withSize(sized, 900, 600)->screens[0].grid.columnWidthsPx.empty()) << "even again";
}

/// A frame between two monitors is as wide as it is: what it hides is the same part of the screen.
TEST(WallWithSize, ShrinksAndGrowsBezelsWithTheTiles) {
    Wall bezels = flatWall(3, 2);
    Screen::Grid& grid = bezels.screens[0].grid;
    grid.tileWidthPx = 640;
    grid.tileHeightPx = 540;
    grid.bezelXPx = 40;
    grid.bezelYPx = 20;
    for (const auto& [width, height, x, y] : {std::array{960, 540, 20, 10},
                                              {480, 270, 10, 5},
                                              {3840, 2160, 80, 40},
                                              {1920, 1080, 40, 20},
                                              {1921, 1081, 40, 20},
                                              {24, 20, 1, 0}}) {
        const Wall sized = *withSize(bezels, width, height);
        EXPECT_EQ(mosaicPixels(sized.screens[0]).width, width);
        EXPECT_EQ(sized.screens[0].grid.bezelXPx, x) << width;
        EXPECT_EQ(sized.screens[0].grid.bezelYPx, y) << height;
    }
}

TEST(WallWithSize, KeepsOverlapsAsTheyAre) {
    Wall overlap = flatWall(3, 1);
    overlap.screens[0].grid.overlapXPx = 10;
    EXPECT_EQ(mosaicPixels(withSize(overlap, 500, 300)->screens[0]).width, 500);
}

TEST(WallWithSize, LetsScreensSideBySideShareTheWidth) {
    const Wall cave = *withSize(caveWall(), 1603, 401);
    std::vector<int> widths;
    for (const Screen& screen : cave.screens) {
        widths.push_back(mosaicPixels(screen).width);
        EXPECT_EQ(mosaicPixels(screen).height, 401);
    }
    EXPECT_EQ(widths, (std::vector<int>{401, 401, 401, 400}));
}

TEST(WallWithSize, RefusesSizesThatCannotBe) {
    const Wall wall = flatWall(3, 2);
    for (const auto& [width, height] :
         {std::pair{0, 100}, {100, -1}, {2, 100}, {100, 1}, {65537, 100}, {60000, 100}, {100, 1 << 30}}) {
        const Expected<Wall> sized = withSize(wall, width, height);
        EXPECT_FALSE(sized) << width << " x " << height;
    }
    Wall overlap = flatWall(2, 1);
    overlap.screens[0].grid.overlapXPx = 100;
    EXPECT_FALSE(withSize(overlap, 100, 100)) << "all of each tile would be overlap";
    Wall bezels = flatWall(2, 1);
    bezels.screens[0].grid.bezelXPx = bezels.screens[0].grid.tileWidthPx / 10;
    EXPECT_FALSE(withSize(bezels, 65530, 100)) << "with the hidden pixels the picture is too large";
}

}  // namespace
}  // namespace tessera
