#include "common/wall/PictureLayout.h"

#include <gtest/gtest.h>

#include "tests/unit/wall/SampleWalls.h"

namespace tessera {
namespace {

using test::caveWall;
using test::flatWall;

const PictureLayout::Place& placeOf(const PictureLayout& layout, const std::string& tile) {
    for (const PictureLayout::Place& place : layout.places) {
        if (place.tile == tile) return place;
    }
    ADD_FAILURE() << tile;
    return layout.places.front();
}

TEST(PictureLayout, CountsFromTheTopWhereTilesCountFromTheBottom) {
    const PictureLayout layout = layoutPicture(flatWall(2, 2, 201, 101), PictureKind::kMosaic);
    EXPECT_EQ(layout.widthPx, 200);
    EXPECT_EQ(layout.heightPx, 100);
    EXPECT_EQ(placeOf(layout, "front-0-0").yPx, 50);
    EXPECT_EQ(placeOf(layout, "front-0-1").yPx, 0);
    EXPECT_EQ(placeOf(layout, "front-1-0").xPx, 100);
}

TEST(PictureLayout, LeavesRoomForBezelsIfAsked) {
    Wall wall = flatWall(2, 2, 200, 100);
    wall.screens[0].grid.bezelXPx = 8;
    wall.screens[0].grid.bezelYPx = 6;
    const PictureLayout mosaic = layoutPicture(wall, PictureKind::kMosaic);
    const PictureLayout bezels = layoutPicture(wall, PictureKind::kWithBezels);
    EXPECT_EQ(mosaic.widthPx, 200);
    EXPECT_EQ(bezels.widthPx, 208);
    EXPECT_EQ(bezels.heightPx, 106);
    EXPECT_EQ(placeOf(mosaic, "front-1-0").xPx, 100);
    EXPECT_EQ(placeOf(bezels, "front-1-0").xPx, 108);
    EXPECT_EQ(placeOf(bezels, "front-1-0").yPx, 56);
}

TEST(PictureLayout, PutsScreensSideBySideOnOneFloor) {
    Wall wall = caveWall();
    wall.screens[1].grid.tileHeightPx = 500;
    const PictureLayout layout = layoutPicture(wall, PictureKind::kMosaic);
    EXPECT_EQ(layout.widthPx, 3200);
    EXPECT_EQ(layout.heightPx, 800);
    EXPECT_EQ(placeOf(layout, "left-0-0").xPx, 800);
    EXPECT_EQ(placeOf(layout, "left-0-0").yPx, 300);
    EXPECT_EQ(placeOf(layout, "floor-0-0").xPx, 2400);
}

TEST(PictureLayout, ShowsWhatOneEyeSees) {
    Wall wall = flatWall(2, 1, 200, 100);
    EXPECT_FALSE(isStereo(wall));
    wall.hosts[1].tiles.push_back(wall.hosts[1].tiles[0]);
    wall.hosts[1].tiles[0].eye = Eye::kRight;
    wall.hosts[1].tiles[1].eye = Eye::kLeft;
    EXPECT_TRUE(isStereo(wall));
    const auto names = [&](Eye eye) {
        std::vector<std::string> all;
        for (const PictureLayout::Place& place : layoutPicture(wall, PictureKind::kMosaic, eye).places)
            all.push_back(place.tile);
        return all;
    };
    EXPECT_EQ(names(Eye::kLeft), (std::vector<std::string>{"front-0-0", "front-1-0-left"}));
    EXPECT_EQ(names(Eye::kCenter), names(Eye::kLeft));
    EXPECT_EQ(names(Eye::kRight), (std::vector<std::string>{"front-0-0", "front-1-0-right"}));
}

TEST(ParsePixels, TakesWidthTimesHeightAndNothingElse) {
    EXPECT_EQ(parsePixels("1920x1080")->width, 1920);
    EXPECT_EQ(parsePixels("641x479")->height, 479);
    for (const char* bad :
         {"", "x", "5", "5x", "x5", "0x5", "5x0", "-5x5", "5x5x5", "5 x 5", "5X5", " 5x5", "99999999999x1"}) {
        EXPECT_FALSE(parsePixels(bad)) << bad;
    }
}

}  // namespace
}  // namespace tessera
