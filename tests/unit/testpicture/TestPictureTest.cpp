/// The test picture is one picture, whatever it is cut into, and says what it should.
#include "client/testpicture/TestPicture.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <random>

#include "common/codec/WallCodec.h"

namespace tessera {
namespace {

using Pixel = std::array<int, 3>;
Pixel pixelAt(const Picture& p, int x, int yFromBelow) {
    const std::size_t at =
        3 * (static_cast<std::size_t>(p.heightPx - 1 - yFromBelow) * static_cast<std::size_t>(p.widthPx) +
             static_cast<std::size_t>(x));
    return {p.rgb[at], p.rgb[at + 1], p.rgb[at + 2]};
}

Wall gridWall(Screen::Grid grid, bool stereo = false) {
    Wall wall;
    wall.name = "test";
    Screen screen;
    screen.name = "front";
    screen.lowerRight = {3.2, 0, 0};
    screen.upperLeft = {0, 1.8, 0};
    screen.grid = std::move(grid);
    wall.screens = {screen};
    wall.users = {User{.name = "viewer", .position = Vec3d(1, 1, 2)}};
    WallHost host{.name = "host-a", .tiles = {}};
    for (int row = 0; row < screen.grid.rows; ++row)
        for (int column = 0; column < screen.grid.columns; ++column)
            for (const Eye eye : stereo ? std::vector{Eye::kLeft, Eye::kRight} : std::vector{Eye::kCenter})
                host.tiles.push_back({.screen = "front", .column = column, .row = row, .eye = eye, .user = "viewer"});
    wall.hosts = {host};
    return wall;
}

Picture wholePicture(int width, int height) {
    const Wall wall = gridWall({.columns = 1, .rows = 1, .tileWidthPx = width, .tileHeightPx = height});
    return testPicture(wall, layoutTiles(wall)[0], {.marks = false});
}

// A failing seed: TESSERA_SEED=N build/bin/unit_testpicture.
TEST(TestPicture, IsOnePictureWhateverItIsCutInto) {
    const char* one = std::getenv("TESSERA_SEED");
    const unsigned first = one ? static_cast<unsigned>(std::stoul(one)) : 1;
    for (unsigned seed = first; seed < first + (one ? 1 : 40); ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_testpicture", seed));
        std::mt19937 random(seed);
        const auto any = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
        Screen::Grid grid{.columns = any(1, 5), .rows = any(1, 4)};
        for (int c = 0; c < grid.columns; ++c) grid.columnWidthsPx.push_back(any(40, 330));
        for (int r = 0; r < grid.rows; ++r) grid.rowHeightsPx.push_back(any(40, 260));
        (any(0, 1) ? grid.bezelXPx : grid.overlapXPx) = any(0, 30);
        (any(0, 1) ? grid.bezelYPx : grid.overlapYPx) = any(0, 30);
        const Wall wall = gridWall(grid, any(0, 3) == 0);
        const ScreenPixels pixels = screenPixels(wall.screens[0]);
        const Picture whole = wholePicture(pixels.width, pixels.height);
        for (const Tile& tile : layoutTiles(wall)) {
            Picture part = Picture::filled(tile.rect.width, tile.rect.height, 1, 2, 3);
            paste(part, whole, -tile.rect.x, -(pixels.height - tile.rect.y - tile.rect.height));
            EXPECT_TRUE(part == testPicture(wall, tile, {.marks = false})) << tile.name;
        }
    }
}

TEST(TestPicture, HasLinesOfOnePixelEverySixtyFourFromTheLowerLeft) {
    const Picture p = wholePicture(1920, 1080);
    // A row and a column where nothing else is drawn but the grid.
    int found = 0;
    for (int x = 70; x < 560; ++x) {
        const bool line = x % 64 == 0;
        const Pixel pixel = pixelAt(p, x, 40), ground = pixelAt(p, 75, 45);
        EXPECT_TRUE(!line || pixel != ground) << x;
        found += pixel != ground && !line;
    }
    EXPECT_LT(found, 60) << "circles and diagonals cross a row here and there, and no more";
    EXPECT_EQ(pixelAt(p, 0, 0), (Pixel{255, 255, 255}));
    EXPECT_EQ(pixelAt(p, 1919, 1079), (Pixel{255, 255, 255}));
    EXPECT_EQ(pixelAt(p, 1, 500), (Pixel{0, 0, 0}));
}

TEST(TestPicture, HasACircleThatClosesAndDiagonalsFromCornerToCorner) {
    const Picture p = wholePicture(1920, 1080);
    // The outer rim of the circle in the middle, all around, at half a degree: something white within two pixels.
    int looked = 0;
    for (int degrees = 0; degrees < 720; ++degrees) {
        const double a = degrees * 3.14159265358979 / 360, r = 0.48 * 1080;
        const int x = static_cast<int>(960 + r * std::cos(a)), y = static_cast<int>(540 + r * std::sin(a));
        // The title lies above it at the top, ramps and patches at the foot.
        const int fromTop = 1079 - y;
        if ((fromTop > 35 && fromTop < 100) || (fromTop > 770 && fromTop < 1050)) continue;
        ++looked;
        bool white = false;
        for (int dx = -2; dx <= 2; ++dx)
            for (int dy = -2; dy <= 2; ++dy) white = white || pixelAt(p, x + dx, y + dy) == Pixel{255, 255, 255};
        EXPECT_TRUE(white) << degrees / 2.0 << " degrees";
    }
    EXPECT_GT(looked, 400);
    for (int i = 8; i < 60; ++i) {  // farther on numbers and circles lie above them
        EXPECT_EQ(pixelAt(p, i, 1079 - i * 1080 / 1920)[0], 230) << i;
        EXPECT_EQ(pixelAt(p, 1919 - i, 1079 - i * 1080 / 1920)[0], 230) << i;
    }
}

TEST(TestPicture, RampsHaveEveryValueOnce) {
    const Picture p = wholePicture(1920, 1080);
    // The row of each bar that lies on the ramps: greys from 0 to 255 without a gap, in order, and each colour alone.
    const int wide = 1024, left = (1920 - wide) / 2;
    for (int channel = -1; channel < 3; ++channel) {
        const int y = 1080 - 1 - (static_cast<int>(0.72 * 1080) + (channel + 1) * 30 + 15);
        for (int i = 0; i < wide; ++i) {
            const Pixel pixel = pixelAt(p, left + i, y);
            for (int c = 0; c < 3; ++c)
                EXPECT_EQ(pixel[static_cast<std::size_t>(c)], channel < 0 || channel == c ? i / 4 : 0) << i;
        }
    }
}

TEST(TestPicture, MarksSayWhichTileItIs) {
    const Wall wall = gridWall({.columns = 2, .rows = 2, .tileWidthPx = 320, .tileHeightPx = 200});
    std::vector<Picture> all;
    for (const Tile& tile : layoutTiles(wall)) {
        all.push_back(testPicture(wall, tile));
        EXPECT_FALSE(all.back() == testPicture(wall, tile, {.marks = false}));
        EXPECT_EQ(pixelAt(all.back(), 0, 100), (Pixel{255, 255, 255})) << "its own border";
        EXPECT_FALSE(testPicture(wall, tile, {.frame = 7}) == testPicture(wall, tile, {.frame = 8}));
        Tile other = tile;
        other.host = "host-b";
        EXPECT_FALSE(all.back() == testPicture(wall, other));
    }
}

TEST(TestPicture, EyesHaveTheirColours) {
    const Wall wall = gridWall({.columns = 1, .rows = 1, .tileWidthPx = 320, .tileHeightPx = 200}, true);
    for (const Tile& tile : layoutTiles(wall)) {
        const Pixel border = pixelAt(testPicture(wall, tile), 0, 100);
        if (tile.eye == Eye::kLeft)
            EXPECT_GT(border[0], border[2]) << "red";
        else
            EXPECT_GT(border[2], border[0]) << "cyan";
    }
}

TEST(TestPicture, HatchesWhatTwoTilesShowAlikeInBoth) {
    const Wall wall = gridWall({.columns = 2, .rows = 1, .tileWidthPx = 320, .tileHeightPx = 200, .overlapXPx = 40});
    const std::vector<Tile> tiles = layoutTiles(wall);
    const Picture left = testPicture(wall, tiles[0]), right = testPicture(wall, tiles[1]);
    int hatched = 0;
    for (int x = 1; x < 39; ++x)
        for (int y = 1; y < 199; ++y) {
            const Pixel a = pixelAt(left, 280 + x, y), b = pixelAt(right, x, y);
            const Pixel pink{230, 80, 230};
            if (a == pink && y < 100) {
                EXPECT_EQ(a, b) << x << " " << y;  // above, labels of the right tile may cover it
                ++hatched;
            }
        }
    EXPECT_GT(hatched, 100);
}

TEST(TestPicture, ShowsEdgesBehindWhichPixelsAreHidden) {
    const Wall wall = gridWall({.columns = 2, .rows = 1, .tileWidthPx = 320, .tileHeightPx = 200, .bezelXPx = 12});
    const std::vector<Tile> tiles = layoutTiles(wall);
    const Pixel orange{255, 150, 30};
    EXPECT_EQ(pixelAt(testPicture(wall, tiles[0]), 318, 50), orange);
    EXPECT_NE(pixelAt(testPicture(wall, tiles[0]), 1, 50), orange);
    EXPECT_EQ(pixelAt(testPicture(wall, tiles[1]), 1, 50), orange);
}

TEST(TestPicture, OfTheSmallestTilesIsAPictureToo) {
    for (const int side : {1, 2, 3, 5, 17}) {
        const Wall wall = gridWall({.columns = 2, .rows = 1, .tileWidthPx = side, .tileHeightPx = side});
        for (const Tile& tile : layoutTiles(wall))
            EXPECT_EQ(testPicture(wall, tile, {.frame = ~std::uint64_t{0}}).widthPx, side);
    }
}

/// For eyes: TESSERA_WRITE_PICTURES=DIR leaves each shipped wall's tiles there.
TEST(TestPicture, OfEveryShippedWallIsDrawn) {
    const char* folder = std::getenv("TESSERA_WRITE_PICTURES");
    for (const char* name : {"2x2", "3x1-bezels", "cave4-stereo", "two-users"}) {
        const Wall wall = loadWall(std::string(TESSERA_SOURCE_DIR "/deploy/walls/") + name + ".wall").value();
        for (const Tile& tile : layoutTiles(wall)) {
            const Picture picture = testPicture(wall, tile, {.frame = 1234});
            EXPECT_EQ(picture.widthPx, tile.rect.width);
            if (folder) {
                ASSERT_TRUE(writeFile(fmt::format("{}/{}-{}.png", folder, name, tile.name), encodePng(picture, {})));
            }
        }
    }
}

}  // namespace
}  // namespace tessera
