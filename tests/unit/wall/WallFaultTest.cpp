/// Every refusal of a wall: that it happens, what it says and which part it points to.
#include <gtest/gtest.h>

#include <cmath>

#include "common/wall/Wall.h"
#include "tests/unit/wall/SampleWalls.h"

namespace tessera {
namespace {

using test::caveWall;
using test::flatWall;
using Part = WallFault::Part;

template <typename Change>
WallFault faultAfter(Change change, Wall wall = flatWall(2, 2)) {
    change(wall);
    std::optional<WallFault> fault = findWallFault(wall);
    if (!fault) {
        ADD_FAILURE() << "the wall was accepted";
        return {};
    }
    const Expected<void> checked = checkWall(wall);
    EXPECT_FALSE(checked);
    EXPECT_EQ(checked.error().message, fault->message);
    EXPECT_EQ(checked.error().code, ErrorCode::kBadInput);
    return *fault;
}

#define EXPECT_SAYS(fault, text) EXPECT_NE((fault).message.find(text), std::string::npos) << (fault).message

TEST(WallFaults, GoodWallsHaveNone) {
    for (const Wall& wall : {flatWall(1, 1), flatWall(2, 2), flatWall(3, 1), caveWall()}) {
        const Expected<void> ok = checkWall(wall);
        EXPECT_TRUE(ok) << ok.error().message;
    }
}

TEST(WallFaults, FindsMissingParts) {
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens.clear(); }), "no screens");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users.clear(); }), "no users");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts.clear(); }), "no hosts");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[2].tiles.clear(); }), "host \"host-0-1\" has no tiles");
}

TEST(WallFaults, FindsTooMuchOfAnything) {
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens.resize(1000); }), "1000 screens");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users.resize(1000); }), "1000 users");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts.resize(5000); }), "5000 hosts");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[0].tiles.resize(5000); }), "tiles");
}

TEST(WallFaults, FindsNearPlanesThatCannotBe) {
    for (const double metres : {0.0, -0.05, 0.0009, 1.1, 50.0, std::nan("")})
        EXPECT_SAYS(faultAfter([=](Wall& w) { w.nearMetres = metres; }), "0.001 to 1 are possible");
    for (const double metres : {0.001, 0.05, 1.0}) {
        Wall wall = flatWall(1, 1);
        wall.nearMetres = metres;
        EXPECT_TRUE(checkWall(wall)) << metres;
    }
}

TEST(WallFaults, FindsNamesThatCannotBeFolders) {
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[0].name = ""; }), "host 1 has no name");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[0].name = "../../etc"; }), "character");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens[0].name = ".."; }), "begins with a dot");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens[0].name = std::string("a\0b", 3); }), "character");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].name = std::string(100, 'x'); }), "longer");
}

TEST(WallFaults, FindsDuplicateNames) {
    const WallFault host = faultAfter([](Wall& w) { w.hosts[3].name = w.hosts[1].name; });
    EXPECT_SAYS(host, "two hosts \"host-1-0\"");
    EXPECT_EQ(host.part, Part::kHost);
    EXPECT_EQ(host.index, 3u);
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users.push_back(w.users[0]); }), "two users");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens.push_back(w.screens[0]); }), "two screens");
}

TEST(WallFaults, FindsCornersThatMakeNoScreen) {
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens[0].lowerRight = w.screens[0].lowerLeft; }), "no area");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens[0].upperLeft = w.screens[0].lowerLeft; }), "no area");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens[0].upperLeft.x() = std::nan(""); }), "finite");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.screens[0].lowerRight.x() = INFINITY; }), "finite");
    const WallFault skewed = faultAfter([](Wall& w) { w.screens[0].upperLeft.x() += 0.2; });
    EXPECT_SAYS(skewed, "skewed");
    EXPECT_SAYS(skewed, "83.66 degrees");
    EXPECT_EQ(skewed.part, Part::kScreen);
}

TEST(WallFaults, FindsMillimetresForMetres) {
    const auto thousandfold = [](Wall& w) {
        for (Screen& s : w.screens) {
            s.lowerLeft *= 1000;
            s.lowerRight *= 1000;
            s.upperLeft *= 1000;
        }
        w.users[0].position *= 1000;
    };
    EXPECT_SAYS(faultAfter(thousandfold), "looks like millimetres");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].position *= 1000; }), "looks like millimetres");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].eyeSeparationMetres = 65; }), "looks like millimetres");
}

TEST(WallFaults, TellsSwappedCornersApart) {
    EXPECT_SAYS(faultAfter([](Wall& w) {
                    Screen& s = w.screens[0];
                    const Vec3d upperRight = s.lowerRight + s.upperLeft - s.lowerLeft;
                    std::swap(s.lowerLeft, s.lowerRight);
                    s.upperLeft = upperRight;
                }),
                "left and right corners swapped");
    EXPECT_SAYS(faultAfter([](Wall& w) { std::swap(w.screens[0].lowerRight, w.screens[0].upperLeft); }),
                "lower_right and upper_left swapped");
    EXPECT_SAYS(faultAfter([](Wall& w) {
                    Screen& s = w.screens[0];
                    const Vec3d upperRight = s.lowerRight + s.upperLeft - s.lowerLeft;
                    std::swap(s.lowerLeft, s.upperLeft);
                    s.lowerRight = upperRight;
                }),
                "upper and lower corners swapped");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].position.z() = -2; }), "the user stands behind it");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].position.y() = -0.5; }, caveWall()), "floor\" shows its back");
}

TEST(WallFaults, FindsAnEyeInThePlaneOfItsScreen) {
    const WallFault fault = faultAfter([](Wall& w) { w.users[0].position.z() = 0; });
    EXPECT_SAYS(fault, "edge-on");
}

TEST(WallFaults, LooksAtEachEyeNotAtTheHead) {
    Wall mono = caveWall();
    Wall stereo = mono;
    for (WallHost& host : stereo.hosts) {
        host.tiles.push_back(host.tiles[0]);
        host.tiles[0].eye = Eye::kLeft;
        host.tiles[1].eye = Eye::kRight;
    }
    EXPECT_TRUE(checkWall(stereo));
    // 2 cm in front of the left wall: the left eye is behind it already.
    mono.users[0].position.x() = stereo.users[0].position.x() = -1.18;
    EXPECT_TRUE(checkWall(mono));
    EXPECT_FALSE(checkWall(stereo));
}

TEST(WallFaults, FindsTilesThatAreAssignedTwice) {
    const WallFault twice = faultAfter([](Wall& w) { w.hosts[3].tiles[0].row = 0; });
    EXPECT_SAYS(twice,
                "host \"host-1-1\": column 1 row 0 of screen \"front\" is assigned twice, first to host \"host-1-0\"");
    EXPECT_EQ(twice.part, Part::kTile);
    EXPECT_EQ(twice.index, 3u);
    EXPECT_EQ(twice.tile, 0u);
    const WallFault mixed = faultAfter([](Wall& w) {
        w.hosts[0].tiles.push_back(w.hosts[0].tiles[0]);
        w.hosts[0].tiles[1].eye = Eye::kLeft;
    });
    EXPECT_SAYS(mixed, "assigned twice");
    EXPECT_EQ(mixed.tile, 1u);
}

TEST(WallFaults, FindsCellsThatNobodyDraws) {
    const WallFault missing = faultAfter([](Wall& w) { w.hosts.erase(w.hosts.begin() + 2); });
    EXPECT_SAYS(missing, "column 0 row 1 of screen \"front\" is drawn by no host");
    EXPECT_EQ(missing.part, Part::kScreen);
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[0].tiles[0].eye = Eye::kLeft; }), "left eye only");
    EXPECT_SAYS(faultAfter([](Wall& w) {
                    Screen second = w.screens[0];
                    second.name = "unused";
                    w.screens.push_back(second);
                }),
                "unused");
}

TEST(WallFaults, SuggestsTheNearestNameForAnUnknownOne) {
    const WallFault screen = faultAfter([](Wall& w) { w.hosts[1].tiles[0].screen = "fornt"; });
    EXPECT_SAYS(screen, "no screen \"fornt\" (did you mean \"front\"?)");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].user = "Viewers"; }), "did you mean \"viewer\"");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].user = ""; }), "known: \"viewer\"");
}

TEST(WallFaults, FindsTilesOffTheGrid) {
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].column = 2; }), "columns 0 to 1");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].row = -1; }), "row -1 is not on screen");
}

TEST(WallFaults, FindsGridsThatCannotBe) {
    using Grid = Screen::Grid;
    const auto grid = [](auto change) { return faultAfter([&](Wall& w) { change(w.screens[0].grid); }); };
    EXPECT_SAYS(grid([](Grid& g) { g.columns = 0; }), "0 columns");
    EXPECT_SAYS(grid([](Grid& g) { g.rows = 1'000'000; }), "1000000 rows");
    EXPECT_SAYS(grid([](Grid& g) { g.tileWidthPx = 0; }), "0 pixels wide");
    EXPECT_SAYS(grid([](Grid& g) { g.tileHeightPx = -5; }), "-5 pixels high");
    EXPECT_SAYS(grid([](Grid& g) { g.bezelXPx = -1; }), "negative");
    EXPECT_SAYS(grid([](Grid& g) { g.overlapYPx = -1; }), "negative");
    EXPECT_SAYS(grid([](Grid& g) { g.bezelXPx = g.overlapXPx = 3; }), "both a bezel and an overlap");
    EXPECT_SAYS(grid([](Grid& g) { g.overlapXPx = 960; }), "overlap by 960");
    EXPECT_SAYS(grid([](Grid& g) { g.columnWidthsPx = {960}; }), "1 column widths");
    EXPECT_SAYS(grid([](Grid& g) { g.rowHeightsPx = {5, 0}; }), "0 pixels high");
}

TEST(WallFaults, FindsPicturesThatAreTooLarge) {
    const auto grid = [](auto change) { return faultAfter([&](Wall& w) { change(w.screens[0].grid); }); };
    EXPECT_SAYS(grid([](Screen::Grid& g) { g.tileWidthPx = 16385; }), "1 to 16384");
    EXPECT_SAYS(grid([](Screen::Grid& g) { g.bezelXPx = 64000; }), "65920 x 1080");
    EXPECT_SAYS(grid([](Screen::Grid& g) { g.bezelYPx = 2'000'000'000; }), "at most 65536");
    Wall most = flatWall(4, 4, 65536, 65536);
    EXPECT_TRUE(checkWall(most));
    most.screens[0].grid.bezelXPx = 1;
    EXPECT_FALSE(checkWall(most)) << "hidden pixels count";
}

TEST(WallFaults, FindsHeadsThatCannotBe) {
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].position.y() = std::nan(""); }), "finite");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].orientation.coeffs().setZero(); }), "orientation");
    for (const double length : {1e-60, 1e50, 1e300, HUGE_VAL, std::nan("")})
        EXPECT_SAYS(faultAfter([&](Wall& w) { w.users[0].orientation.coeffs().setConstant(length); }),
                    "beyond what numbers can hold");
    EXPECT_SAYS(faultAfter([](Wall& w) { w.users[0].eyeSeparationMetres = -0.065; }), "eyes");
}

TEST(WallFaults, FindsTimesThatMakeNoSense) {
    using namespace std::chrono_literals;
    const auto sync = [](auto change) { return faultAfter([&](Wall& w) { change(w.sync); }); };
    EXPECT_SAYS(sync([](SyncPolicy& s) { s.heartbeat = 500ms; }),
                "lost_after_ms has to be at least twice heartbeat_ms");
    EXPECT_SAYS(sync([](SyncPolicy& s) { s.heartbeat = 0ms; }), "heartbeat_ms is 0");
    EXPECT_SAYS(sync([](SyncPolicy& s) { s.frameDeadline = -1ms; }), "frame_deadline_ms is -1");
    EXPECT_SAYS(sync([](SyncPolicy& s) { s.startDeadline = 0ms; }), "start_deadline_ms");
    EXPECT_SAYS(sync([](SyncPolicy& s) { s.firstFrameDeadline = 0ms; }), "first_frame_deadline_ms is 0");
    EXPECT_SAYS(sync([](SyncPolicy& s) { s.frameDeadline = 100h; }), "frame_deadline_ms");
    const WallFault late = sync([](SyncPolicy& s) {
        s.lateFrame = LateFramePolicy::kHold;
        s.lateAfter = s.frameDeadline;
    });
    EXPECT_SAYS(late, "below frame_deadline_ms");
    EXPECT_EQ(late.part, Part::kSync);
}

TEST(WallFaults, FindsSampleCountsThatNoSurfaceHas) {
    for (const int samples : {0, 2, 3, 16, -4})
        EXPECT_SAYS(faultAfter([&](Wall& w) { w.samples = samples; }), "1 and 4 are possible");
}

}  // namespace
}  // namespace tessera
