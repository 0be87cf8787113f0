#include "common/wall/WallNotes.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

Wall wallOf(double heightMetres) {
    Screen screen;
    screen.name = "front";
    screen.lowerRight = Vec3d(1.6, 0, 0);
    screen.upperLeft = Vec3d(0, heightMetres, 0);
    screen.grid.columns = 2;
    screen.grid.tileWidthPx = 800;
    screen.grid.tileHeightPx = 900;
    Wall wall;
    wall.screens = {screen};
    return wall;
}

TEST(WallNotes, NameScreensWhosePixelsAreNotSquare) {
    EXPECT_TRUE(wallNotes(wallOf(0.9)).empty());
    EXPECT_TRUE(wallNotes(wallOf(0.91)).empty()) << "measured by hand";
    const std::vector<std::string> notes = wallNotes(wallOf(1.8));
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(notes[0], "screen \"front\": its pixels are not square but 1 x 2 mm: 1.6 x 1.8 m hold 1600 x 900 pixels");
}

}  // namespace
}  // namespace tessera
