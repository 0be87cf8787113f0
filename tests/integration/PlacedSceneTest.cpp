/// Scenes of the command line stand as a person says: --up, --at, --fit, --point-radius of tessera-server and
/// tessera-wall.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

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
    const TemporaryFolder folder;
    const std::string field = folder.write("field.ply", fieldPly());

    /// The Transform that holds it, and what the server said of it.
    struct Stand {
        std::vector<double> translation, rotation, scale;
        std::string log;
    };
    Stand standOf(std::vector<std::string> options) {
        AskedWall wall({.wall = "1x1", .scene = field, .size = "96x54", .server = std::move(options)});
        EXPECT_TRUE(wall.start()) << wall.logs();
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

/// Of the screen of the wall 1x1 what is not background, in metres of the wall.
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

/// What stands in metres of the wall is seen there: a cube of 0.5 in the plane of the screen is 0.5 on the screen,
/// whatever camera its file has.
TEST_F(Placed, WhatStandsInMetresIsSeenSoLargeAndThere) {
    (void)folder.write("inner.tsct", "node { name: \"watch\" camera {} transform { translation { x: 50 } } }\n");
    const std::string scene = folder.write("cube.tsct",
                                           "node { name: \"eye\" camera {} transform { translation { z: 40 } } }\n"
                                           "node { name: \"cube\" box { size { x: 7 y: 7 z: 0.01 } } }\nnode { name: "
                                           "\"more\" inline { file: \"inner.tsct\" } }\n");
    const auto seen = [&](std::vector<std::string> options, const std::vector<std::vector<std::string>>& told = {}) {
        AskedWall wall({.wall = "1x1", .scene = scene, .size = "320x180", .server = std::move(options)});
        EXPECT_TRUE(wall.start()) << wall.logs();
        for (const std::vector<std::string>& words : told) wall.tell(words);
        wall.settle();
        const SeenBox box = seenOn(wall.picture("seen"));
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
                    .size = "96x54",
                    .server = {"--point-radius", "0.75", "--allow", folder.path()}});
    ASSERT_TRUE(wall.start()) << wall.logs();
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

TEST_F(Placed, TheLauncherHandsItOnAndTheReplayFindsTheSame) {
    const std::string recording = folder.path() + "/field.tsr";
    const Outcome wall = run(folder.path(),
                             {program("tessera-wall"),
                              "--wall",
                              "1x1",
                              "--size",
                              "96x54",
                              "--frames",
                              "3",
                              "--scene",
                              field,
                              "--up",
                              "z",
                              "--at",
                              "-1",
                              "0",
                              "0",
                              "--fit",
                              "3",
                              "--point-radius",
                              "0.5",
                              "--record",
                              recording,
                              "--output",
                              folder.path() + "/out"},
                             60s);
    EXPECT_EQ(wall.exitCode, 0) << wall.output;
    EXPECT_EQ(wall.output.find("which way is up"), std::string::npos) << "it was said: " << wall.output;
    const Outcome replay = run(folder.path(), {program("tessera-replay"), recording}, 60s);
    EXPECT_EQ(replay.exitCode, 0) << replay.output;
}

TEST_F(Placed, WhatCannotBeIsRefusedInWords) {
    const auto refused = [&](const std::string& name, std::vector<std::string> options, const std::string& says) {
        std::vector<std::string> command = {program(name), "--wall", "1x1", "--scene", field, "--frames", "1"};
        command.insert(command.end(), options.begin(), options.end());
        if (name == "tessera-wall") command.insert(command.end(), {"--output", folder.path() + "/out"});
        const Outcome outcome = run(folder.path(), command, 60s);
        EXPECT_EQ(outcome.exitCode, 2) << outcome.output;
        EXPECT_NE(outcome.output.find(says), std::string::npos) << outcome.output;
    };
    for (const char* name : {"tessera-server", "tessera-wall"}) {
        refused(name, {"--up", "x"}, "--up");
        refused(name, {"--fit", "-1"}, "--fit -1: a size of -1: it has to be between");
        refused(name, {"--at", "0", "nan", "0"}, "--at 0 nan 0: it would stand farther");
        refused(name, {"--point-radius", "0"}, "--point-radius 0: a radius of points of 0");
    }
}

TEST_F(Placed, AJournalGoesOnWithTheSameWordsAlone) {
    const std::string journal = folder.path() + "/journal";
    const auto frames = [&](std::vector<std::string> options) {
        std::vector<std::string> command = {program("tessera-wall"),
                                            "--wall",
                                            "1x1",
                                            "--size",
                                            "96x54",
                                            "--frames",
                                            "2",
                                            "--scene",
                                            field,
                                            "--journal",
                                            journal,
                                            "--output",
                                            folder.path() + "/out"};
        command.insert(command.end(), options.begin(), options.end());
        return run(folder.path(), command, 60s);
    };
    EXPECT_EQ(frames({"--up", "z", "--fit", "3"}).exitCode, 0);
    const Outcome again = frames({"--up", "z", "--fit", "3"});
    EXPECT_EQ(again.exitCode, 0) << again.output;
    EXPECT_NE(again.output.find("goes on with frame"), std::string::npos) << again.output;
    const Outcome other = frames({"--up", "y", "--fit", "3"});
    EXPECT_EQ(other.exitCode, 2) << other.output;
    EXPECT_NE(other.output.find("it goes on from a wall that began with --scene " + field +
                                " --fit 3 --up z; this command says --scene " + field + " --fit 3 --up y"),
              std::string::npos)
        << other.output;
}

/// Paths begin at the root: with a name of its own it came back from a file a level deeper.
TEST(RootNode, CannotBeRenamedByAnybody) {
    AskedWall wall({.wall = "1x1", .size = "64x36"});
    ASSERT_TRUE(wall.start()) << wall.logs();
    const Outcome refused = wall.wall().ctl({"set", "/", "name", "hall"});
    EXPECT_EQ(refused.exitCode, 1) << refused.output;
    EXPECT_NE(refused.output.find("it is the root, which has no name: all paths begin there; name a node below it"),
              std::string::npos)
        << refused.output;
    const std::string core = "#" + std::to_string(wall.ask({"get", "/floor"})["core"]["id"].get<std::uint64_t>());
    const Outcome placed = wall.wall().ctl({"set", "/", "core", core});
    EXPECT_EQ(placed.exitCode, 1) << placed.output;
    EXPECT_NE(placed.output.find(
                  "it is the root, which has no core: all places and paths begin there; give it to a node below it"),
              std::string::npos)
        << placed.output;
    EXPECT_EQ(wall.wall().ctl({"undo"}).exitCode, 1) << "nothing was done";
    const std::string file = wall.folder() + "/now.tsct";
    EXPECT_EQ(wall.wall().ctl({"save", file}).exitCode, 0);
    EXPECT_EQ(run(wall.folder(), {program("tessera-check"), file}, 60s).exitCode, 0);
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::test
