/// Every refusal of a wall: that it happens, what it says and which part it points to.
#include <gtest/gtest.h>

#include <cmath>

#include "common/wall/Wall.h"
#include "tests/support/words/Words.h"
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

TEST(WallFaults, GoodWallsHaveNone) {
    for (const Wall& wall : {flatWall(1, 1), flatWall(2, 2), flatWall(3, 1), caveWall()}) {
        const Expected<void> ok = checkWall(wall);
        EXPECT_TRUE(ok) << ok.error().message;
    }
}

TEST(WallFaults, FindsMissingParts) {
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens.clear(); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users.clear(); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts.clear(); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[2].tiles.clear(); }).message);
}

TEST(WallFaults, FindsTooMuchOfAnything) {
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens.resize(1000); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users.resize(1000); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts.resize(5000); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[0].tiles.resize(5000); }).message);
}

TEST(WallFaults, FindsNearPlanesThatCannotBe) {
    for (const double metres : {0.0, -0.05, 0.0009, 1.1, 50.0, std::nan("")})
        EXPECT_WORDS(faultAfter([=](Wall& w) { w.nearMetres = metres; }).message);
    for (const double metres : {0.001, 0.05, 1.0}) {
        Wall wall = flatWall(1, 1);
        wall.nearMetres = metres;
        EXPECT_TRUE(checkWall(wall)) << metres;
    }
}

TEST(WallFaults, FindsNamesThatCannotBeFolders) {
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[0].name = ""; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[0].name = "../../etc"; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens[0].name = ".."; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens[0].name = std::string("a\0b", 3); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].name = std::string(100, 'x'); }).message);
}

TEST(WallFaults, FindsDuplicateNames) {
    const WallFault host = faultAfter([](Wall& w) { w.hosts[3].name = w.hosts[1].name; });
    EXPECT_WORDS(host.message);
    EXPECT_EQ(host.part, Part::kHost);
    EXPECT_EQ(host.index, 3u);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users.push_back(w.users[0]); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens.push_back(w.screens[0]); }).message);
}

TEST(WallFaults, FindsCornersThatMakeNoScreen) {
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens[0].lowerRight = w.screens[0].lowerLeft; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens[0].upperLeft = w.screens[0].lowerLeft; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens[0].upperLeft.x() = std::nan(""); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.screens[0].lowerRight.x() = INFINITY; }).message);
    const WallFault skewed = faultAfter([](Wall& w) { w.screens[0].upperLeft.x() += 0.2; });
    EXPECT_WORDS(skewed.message);
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
    EXPECT_WORDS(faultAfter(thousandfold).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].position *= 1000; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].eyeSeparationMetres = 65; }).message);
}

TEST(WallFaults, TellsSwappedCornersApart) {
    EXPECT_WORDS(faultAfter([](Wall& w) {
                     Screen& s = w.screens[0];
                     const Vec3d upperRight = s.lowerRight + s.upperLeft - s.lowerLeft;
                     std::swap(s.lowerLeft, s.lowerRight);
                     s.upperLeft = upperRight;
                 }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { std::swap(w.screens[0].lowerRight, w.screens[0].upperLeft); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) {
                     Screen& s = w.screens[0];
                     const Vec3d upperRight = s.lowerRight + s.upperLeft - s.lowerLeft;
                     std::swap(s.lowerLeft, s.upperLeft);
                     s.lowerRight = upperRight;
                 }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].position.z() = -2; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].position.y() = -0.5; }, caveWall()).message);
}

TEST(WallFaults, FindsAnEyeInThePlaneOfItsScreen) {
    const WallFault fault = faultAfter([](Wall& w) { w.users[0].position.z() = 0; });
    EXPECT_WORDS(fault.message);
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
    EXPECT_WORDS(twice.message);
    EXPECT_EQ(twice.part, Part::kTile);
    EXPECT_EQ(twice.index, 3u);
    EXPECT_EQ(twice.tile, 0u);
    const WallFault mixed = faultAfter([](Wall& w) {
        w.hosts[0].tiles.push_back(w.hosts[0].tiles[0]);
        w.hosts[0].tiles[1].eye = Eye::kLeft;
    });
    EXPECT_WORDS(mixed.message);
    EXPECT_EQ(mixed.tile, 1u);
}

TEST(WallFaults, FindsCellsThatNobodyDraws) {
    const WallFault missing = faultAfter([](Wall& w) { w.hosts.erase(w.hosts.begin() + 2); });
    EXPECT_WORDS(missing.message);
    EXPECT_EQ(missing.part, Part::kScreen);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[0].tiles[0].eye = Eye::kLeft; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) {
                     Screen second = w.screens[0];
                     second.name = "unused";
                     w.screens.push_back(second);
                 }).message);
}

TEST(WallFaults, SuggestsTheNearestNameForAnUnknownOne) {
    const WallFault screen = faultAfter([](Wall& w) { w.hosts[1].tiles[0].screen = "fornt"; });
    EXPECT_WORDS(screen.message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].user = "Viewers"; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].user = ""; }).message);
}

TEST(WallFaults, FindsTilesOffTheGrid) {
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].column = 2; }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.hosts[1].tiles[0].row = -1; }).message);
}

TEST(WallFaults, FindsGridsThatCannotBe) {
    using Grid = Screen::Grid;
    const auto grid = [](auto change) { return faultAfter([&](Wall& w) { change(w.screens[0].grid); }); };
    EXPECT_WORDS(grid([](Grid& g) { g.columns = 0; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.rows = 1'000'000; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.tileWidthPx = 0; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.tileHeightPx = -5; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.bezelXPx = -1; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.overlapYPx = -1; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.bezelXPx = g.overlapXPx = 3; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.overlapXPx = 960; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.columnWidthsPx = {960}; }).message);
    EXPECT_WORDS(grid([](Grid& g) { g.rowHeightsPx = {5, 0}; }).message);
}

TEST(WallFaults, FindsPicturesThatAreTooLarge) {
    const auto grid = [](auto change) { return faultAfter([&](Wall& w) { change(w.screens[0].grid); }); };
    EXPECT_WORDS(grid([](Screen::Grid& g) { g.tileWidthPx = 16385; }).message);
    EXPECT_WORDS(grid([](Screen::Grid& g) { g.bezelXPx = 64000; }).message);
    EXPECT_WORDS(grid([](Screen::Grid& g) { g.bezelYPx = 2'000'000'000; }).message);
    Wall most = flatWall(4, 4, 65536, 65536);
    EXPECT_TRUE(checkWall(most));
    most.screens[0].grid.bezelXPx = 1;
    EXPECT_FALSE(checkWall(most)) << "hidden pixels count";
}

TEST(WallFaults, FindsHeadsThatCannotBe) {
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].position.y() = std::nan(""); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].orientation.coeffs().setZero(); }).message);
    for (const double length : {1e-60, 1e50, 1e300, HUGE_VAL, std::nan("")})
        EXPECT_WORDS(faultAfter([&](Wall& w) { w.users[0].orientation.coeffs().setConstant(length); }).message);
    EXPECT_WORDS(faultAfter([](Wall& w) { w.users[0].eyeSeparationMetres = -0.065; }).message);
}

TEST(WallFaults, FindsTimesThatMakeNoSense) {
    using namespace std::chrono_literals;
    const auto sync = [](auto change) { return faultAfter([&](Wall& w) { change(w.sync); }); };
    EXPECT_WORDS(sync([](SyncPolicy& s) { s.heartbeat = 500ms; }).message);
    EXPECT_WORDS(sync([](SyncPolicy& s) { s.heartbeat = 0ms; }).message);
    EXPECT_WORDS(sync([](SyncPolicy& s) { s.frameDeadline = -1ms; }).message);
    EXPECT_WORDS(sync([](SyncPolicy& s) { s.startDeadline = 0ms; }).message);
    EXPECT_WORDS(sync([](SyncPolicy& s) { s.firstFrameDeadline = 0ms; }).message);
    EXPECT_WORDS(sync([](SyncPolicy& s) { s.frameDeadline = 100h; }).message);
    const WallFault late = sync([](SyncPolicy& s) {
        s.lateFrame = LateFramePolicy::kHold;
        s.lateAfter = s.frameDeadline;
    });
    EXPECT_WORDS(late.message);
    EXPECT_EQ(late.part, Part::kSync);
}

TEST(WallFaults, FindsSampleCountsThatNoSurfaceHas) {
    for (const int samples : {0, 2, 3, 16, -4}) EXPECT_WORDS(faultAfter([&](Wall& w) { w.samples = samples; }).message);
}

}  // namespace
}  // namespace tessera
