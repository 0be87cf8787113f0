/// Scenes of the command line stand as a person says: --up, --at, --fit, --point-radius of
/// tessera-wall.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "tests/integration/LiveWall.h"

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
};

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

}  // namespace
}  // namespace tessera::test
