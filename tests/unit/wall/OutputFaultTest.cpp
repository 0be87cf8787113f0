/// What is said of outputs that make no sense.
#include <gtest/gtest.h>

#include <limits>

#include "common/wall/Wall.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

/// Two tiles that overlap, with one host each; or the two eyes of one tile on one host.
Wall twoTiles() {
    Wall wall;
    Screen screen{.name = "s", .lowerLeft = {-1.6, 0.6, 0}, .lowerRight = {1.6, 0.6, 0}, .upperLeft = {-1.6, 2.4, 0}};
    screen.grid = {.columns = 2, .rows = 1, .tileWidthPx = 101, .tileHeightPx = 51, .overlapXPx = 11};
    wall.screens = {screen};
    wall.users = {User{.name = "u"}};
    wall.hosts = {{.name = "a", .tiles = {{.screen = "s", .column = 0, .user = "u"}}},
                  {.name = "b", .tiles = {{.screen = "s", .column = 1, .user = "u"}}}};
    return wall;
}
Wall twoEyes() {
    Wall wall = twoTiles();
    wall.screens[0].grid = {.columns = 1, .rows = 1, .tileWidthPx = 101, .tileHeightPx = 51};
    wall.hosts = {
        {.name = "a",
         .tiles = {{.screen = "s", .eye = Eye::kLeft, .user = "u"}, {.screen = "s", .eye = Eye::kRight, .user = "u"}}}};
    return wall;
}

/// Of the first tile's output, and of the second one's.
template <typename Change>
std::string said(Wall wall, Change change) {
    TileOutput& first = wall.hosts[0].tiles[0].output;
    TileOutput& second = wall.hosts.back().tiles.back().output;
    change(first, second);
    const auto fault = findWallFault(wall);
    if (!fault) return "accepted";
    EXPECT_EQ(fault->part, WallFault::Part::kTile);
    return fault->message;
}

TEST(Outputs, ThatMakeSenseAreAccepted) {
    EXPECT_EQ(said(twoTiles(),
                   [](TileOutput& a, TileOutput& b) {
                       a.blend = b.blend = true;
                       a.black = 0.001;
                       b.gain = {0, 4, 1};
                   }),
              "accepted");
    EXPECT_EQ(said(twoTiles(), [](TileOutput& a, TileOutput&) { a.monitor = "HDMI-1"; }), "accepted");
    EXPECT_EQ(said(twoEyes(),
                   [](TileOutput& left, TileOutput&) {
                       left.stereo = StereoPacking::kAnaglyph;
                       left.swapEyes = true;
                   }),
              "accepted");
    EXPECT_EQ(said(twoEyes(), [](TileOutput& left, TileOutput& right) { left.flipX = right.flipY = true; }), "accepted")
        << "each eye its own projector";
}

TEST(Outputs, ThatMakeNoneAreExplained) {
    const auto alone = [](auto change) { return said(twoTiles(), [&](TileOutput& a, TileOutput&) { change(a); }); };
    EXPECT_WORDS(alone([](TileOutput& o) { o.widthPx = 100; }));
    EXPECT_WORDS(alone([](TileOutput& o) {
        o.widthPx = -1;
        o.heightPx = 5;
    }));
    EXPECT_WORDS(alone([](TileOutput& o) {
        o.widthPx = std::numeric_limits<int>::max();
        o.heightPx = 5;
    }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.gain[1] = -0.1; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.gain[1] = std::numeric_limits<double>::quiet_NaN(); }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.gamma[2] = 0; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.black = 0.5; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.black = 0.01; }));
    EXPECT_WORDS(alone([](TileOutput& o) {
        o.blend = true;
        o.blendPicture = share(Bytes(3));
    }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.blendPictureGamma = 0; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.monitor = "a\nb"; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.monitor = std::string(1000, 'm'); }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.warpFile = "a.warp"; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.blendFile = "a.png"; }));
    EXPECT_WORDS(alone([](TileOutput& o) {
        o.warp = std::make_shared<const WarpMesh>(WarpMesh{.columns = 2, .rows = 2, .nodes = {}});
    }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.swapEyes = true; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.stereo = StereoPacking::kRows; }));
    EXPECT_WORDS(alone([](TileOutput& o) { o.blend = true; }));
}

TEST(Outputs, OfTwoEyesBelongToOneHost) {
    EXPECT_WORDS(said(twoEyes(), [](TileOutput&, TileOutput& right) { right.stereo = StereoPacking::kRows; }));
    EXPECT_WORDS(said(twoEyes(), [](TileOutput& left, TileOutput& right) {
        left.stereo = StereoPacking::kRows;
        right.flipX = true;
    }));
    EXPECT_WORDS(said(twoEyes(), [](TileOutput& left, TileOutput&) { left.stereo = StereoPacking::kSideBySide; }));
    EXPECT_WORDS(said(twoEyes(), [](TileOutput& left, TileOutput&) { left.stereo = StereoPacking::kTopBottom; }));
    Wall apart = twoEyes();
    apart.hosts.push_back({.name = "b", .tiles = {apart.hosts[0].tiles[1]}});
    apart.hosts[0].tiles.pop_back();
    EXPECT_WORDS(said(apart, [](TileOutput& left, TileOutput&) { left.stereo = StereoPacking::kRows; }));
}

TEST(Outputs, OfOneHostHaveMonitorsOfTheirOwn) {
    Wall one = twoTiles();
    one.hosts[0].tiles.push_back(one.hosts[1].tiles[0]);
    one.hosts.pop_back();
    const auto named = [](std::string first, std::string second) {
        return [=](TileOutput& a, TileOutput& b) {
            a.monitor = first;
            b.monitor = second;
        };
    };
    EXPECT_WORDS(said(one, named("HDMI-1", "hdmi-1")));
    EXPECT_WORDS(said(twoEyes(), named("0", "0")));
    EXPECT_EQ(said(one, named("0", "1")), "accepted");
    EXPECT_EQ(said(one, named("", "")), "accepted") << "none is named";
    EXPECT_EQ(said(twoTiles(), named("0", "0")), "accepted")
        << "hosts of their own, which may have desktops of their own";
    EXPECT_EQ(said(twoEyes(),
                   [](TileOutput& left, TileOutput&) {
                       left.monitor = "0";
                       left.stereo = StereoPacking::kAnaglyph;
                   }),
              "accepted");
}

TEST(Outputs, AreBlendedWhereTilesOverlapByHalfAtMost) {
    Wall wall = twoTiles();
    wall.screens[0].grid.overlapXPx = 0;
    EXPECT_WORDS(said(wall, [](TileOutput& a, TileOutput& b) { a.blend = b.blend = true; }));
    wall.screens[0].grid.overlapXPx = 51;
    EXPECT_WORDS(said(wall, [](TileOutput& a, TileOutput& b) { a.blend = b.blend = true; }));
}

}  // namespace
}  // namespace tessera
