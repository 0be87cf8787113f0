/// Scenes of the command line stand as a person says: --up, --at, --fit, --point-radius of tessera-server.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "server/tools/CheckCommand.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

/// 40 m by 20 m, 3 m high, +Z up: what a plane with a scanner leaves of a field with a hill.
std::string fieldPly() {
    std::string points;
    std::size_t count = 0;
    for (int x = 0; x <= 40; ++x)
        for (int y = 0; y <= 20; ++y, ++count)
            points +=
                fmt::format("{} {} {}\n", x, y, 3 * std::exp(-0.02 * ((x - 20) * (x - 20) + (y - 10) * (y - 10))));
    return fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
        "z\nend_header\n{}",
        count, points);
}

struct Placed : testing::Test {
    const test::TestFolder folder;
    const std::string field = folder.write("field.ply", fieldPly());

    /// The Transform that holds it, and what the server said of it.
    struct Stand {
        std::vector<double> translation, rotation, scale;
        std::string log;
    };
    Stand standOf(std::vector<std::string> options) {
        AskedWall wall({.wall = "1x1", .scene = field, .widthPx = 96, .heightPx = 54, .server = std::move(options)});
        const nlohmann::json core = wall.ask({"tree", "/field"})["core"];
        Stand stand{core["translation"], core["rotation"], core["scale"], wall.logs()};
        (void)wall.finish();
        return stand;
    }
};

TEST_F(Placed, AFlatCloudLiesAndTheHintNamesAnOptionThatWorks) {
    const Stand guessed = standOf({});
    EXPECT_NEAR(guessed.rotation[0], std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(guessed.rotation[1], -std::sqrt(0.5), 1e-12);
    EXPECT_NE(guessed.log.find("its points lie flat as if seen from above; +Z is taken to be (--up y says otherwise)"),
              std::string::npos)
        << guessed.log;
    const Stand told = standOf({"--up", "y"});
    EXPECT_EQ(told.rotation, (std::vector<double>{1, 0, 0, 0}));
    EXPECT_EQ(told.log.find("which way is up"), std::string::npos) << told.log;
}

TEST_F(Placed, AtAndFitSayWhereItStandsAndHowLargeItIs) {
    const Stand stand = standOf({"--fit", "2", "--at", "1", "0.5", "-3"});
    // 40 become 2; the middle of its underside comes to the place that was said.
    for (const double factor : stand.scale) EXPECT_NEAR(factor, 2.0 / 40, 2e-3);
    EXPECT_NEAR(stand.translation[0], 1 - 20 * 0.05, 0.06);
    EXPECT_NEAR(stand.translation[2], -3 + 10 * 0.05, 0.06);
}

/// The part of the screen of the wall 1x1 that is not background, in metres of the wall.
struct SeenBox {
    double left = 1e9, right = -1e9, bottom = 1e9, top = -1e9;
};
SeenBox seenOn(const Picture& picture) {
    SeenBox box;
    const double metres = 3.2 / picture.widthPx, lowerEdge = 0.6;
    for (int y = 0; y < picture.heightPx; ++y)
        for (int x = 0; x < picture.widthPx; ++x) {
            const std::uint8_t* const pixel =
                &picture.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.widthPx) +
                                  static_cast<std::size_t>(x))];
            if (std::equal(pixel, pixel + 3, picture.rgb.data())) continue;  // the upper left one shows nothing
            const double left = x * metres - 1.6, top = lowerEdge + (picture.heightPx - y) * metres;
            box = {std::min(box.left, left), std::max(box.right, left + metres), std::min(box.bottom, top - metres),
                   std::max(box.top, top)};
        }
    return box;
}

/// A thing that stands in metres of the wall is seen there: a cube of 0.5 in the plane of the screen is 0.5 on the
/// screen, whatever camera its file has.
TEST_F(Placed, WhatStandsInMetresIsSeenSoLargeAndThere) {
    (void)folder.write("inner.tsct", "node { name: \"watch\" camera {} transform { translation { x: 50 } } }\n");
    const std::string scene = folder.write("cube.tsct",
                                           "node { name: \"eye\" camera {} transform { translation { z: 40 } } }\n"
                                           "node { name: \"cube\" box { size { x: 7 y: 7 z: 0.01 } } }\nnode { name: "
                                           "\"more\" inline { file: \"inner.tsct\" } }\n");
    const auto seen = [&](std::vector<std::string> options, const std::vector<std::vector<std::string>>& told = {}) {
        AskedWall wall({.wall = "1x1", .scene = scene, .widthPx = 320, .heightPx = 180, .server = std::move(options)});
        for (const std::vector<std::string>& words : told) wall.tell(words);
        wall.settle();
        const SeenBox box = seenOn(wall.settledPicture());
        (void)wall.finish();
        return box;
    };
    const auto expectBox = [](const SeenBox& box, double left, double right, double bottom, double top) {
        constexpr double kWithin = 0.021;  // two pixels
        EXPECT_NEAR(box.left, left, kWithin);
        EXPECT_NEAR(box.right, right, kWithin);
        EXPECT_NEAR(box.bottom, bottom, kWithin);
        EXPECT_NEAR(box.top, top, kWithin);
    };
    expectBox(seen({"--fit", "0.5", "--at", "0", "1", "0"}), -0.25, 0.25, 1, 1.5);
    expectBox(seen({"--fit", "0.5", "--at", "0.75", "0.5", "0"}), 0.5, 1, 0.6, 1);
    expectBox(
        seen({"--fit", "1", "--at", "0.75", "0.5", "0"}, {{"view", "--position", "3", "4", "5"}, {"view", "--reset"}}),
        0.25, 1.25, 0.6, 1.5);
    // A camera that is named leads.
    const SeenBox named = seen({"--fit", "0.5", "--at", "0", "1", "0", "--camera", "/cube/eye/camera"});
    EXPECT_LT(named.right - named.left, 0.45);
}

TEST_F(Placed, ARadiusOfPointsIsThatOfAllTilesAndOfLoadsToo) {
    AskedWall wall({.wall = "2x2",
                    .scene = field,
                    .widthPx = 96,
                    .heightPx = 54,
                    .server = {"--point-radius", "0.75", "--allow", folder.path()}});
    const auto radii = [&] {
        std::vector<double> all;
        const nlohmann::json found = wall.ask({"find", "//*[Geometry]"});
        for (const nlohmann::json& node : found["nodes"])
            all.push_back(wall.ask({"get", node["path"]})["core"]["pointRadius"].get<double>());
        return all;
    };
    EXPECT_EQ(radii(), std::vector<double>{0.75});
    wall.tell({"load", field, "--point-radius", "0.125"});
    EXPECT_EQ(radii(), (std::vector<double>{0.75, 0.125}));
    (void)wall.finish();
}

/// Paths begin at the root: with a name of its own it came back from a file a level deeper.
TEST(RootNode, CannotBeRenamedByAnybody) {
    AskedWall wall({.wall = "1x1", .widthPx = 64, .heightPx = 36});
    const CommandOutcome refused = wall.ctl({"set", "/", "name", "hall"});
    EXPECT_EQ(refused.exitCode, 1) << refused.output;
    EXPECT_WORDS(refused.output);
    const std::string core = "#" + std::to_string(wall.ask({"get", "/floor"})["core"]["id"].get<std::uint64_t>());
    const CommandOutcome placed = wall.ctl({"set", "/", "core", core});
    EXPECT_EQ(placed.exitCode, 1) << placed.output;
    EXPECT_WORDS(placed.output);
    EXPECT_EQ(wall.ctl({"undo"}).exitCode, 1) << "nothing was done";
    const std::string file = wall.folder() + "/now.tsct";
    EXPECT_EQ(wall.ctl({"save", file}).exitCode, 0);
    EXPECT_EQ(runHere([&] { return runCheck({file}); }).exitCode, 0);
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::simulation
