/// Scenes of the command line stand as a person says: --up, --at, --fit, --point-radius of tessera-wall and
/// tessera-server.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "tests/integration/ThreadWall.h"

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

/// Options of scenes that cannot be, and what is said of them.
const std::vector<std::pair<std::vector<std::string>, std::string>> kRefused = {
    {{"--up", "x"}, "--up"},
    {{"--fit", "-1"}, "--fit -1: a size of -1: it has to be between"},
    {{"--at", "0", "nan", "0"}, "--at 0 nan 0: it would stand farther"},
    {{"--point-radius", "0"}, "--point-radius 0: a radius of points of 0"}};

struct Placed : testing::Test {
    const TemporaryFolder folder;
    const std::string field = folder.write("field.ply", fieldPly());
};

TEST_F(Placed, TheLauncherHandsItOnAndTheReplayFindsTheSame) {
    const std::string recording = folder.path() + "/field.tsr";
    const auto wall = [&](std::vector<std::string> options) {
        std::vector<std::string> command = {
            program("tessera-wall"), "--wall", "1x1", "--size", "96x54", "--frames", "3", "--scene", field, "--output",
            folder.path() + "/out"};
        command.insert(command.end(), options.begin(), options.end());
        return run(folder.path(), command, 60s);
    };
    const Outcome shown =
        wall({"--up", "z", "--at", "-1", "0", "0", "--fit", "3", "--point-radius", "0.5", "--record", recording});
    EXPECT_EQ(shown.exitCode, 0) << shown.output;
    EXPECT_EQ(shown.output.find("which way is up"), std::string::npos) << "it was said: " << shown.output;
    const Outcome replay = run(folder.path(), {program("tessera-replay"), recording}, 60s);
    EXPECT_EQ(replay.exitCode, 0) << replay.output;
    for (const auto& [options, says] : kRefused) {
        const Outcome refused = wall(options);
        EXPECT_EQ(refused.exitCode, 2) << refused.output;
        EXPECT_NE(refused.output.find(says), std::string::npos) << refused.output;
    }
}

TEST_F(Placed, WhatCannotBeIsRefusedInWords) {
    for (const auto& [options, says] : kRefused) {
        const Refused refused = refusedWords(options);
        EXPECT_EQ(refused.exitCode, 2);
        EXPECT_NE(refused.words.find(says), std::string::npos) << refused.words;
    }
}

TEST_F(Placed, AJournalGoesOnWithTheSameWordsAlone) {
    const std::string journal = folder.path() + "/journal";
    const auto frames = [&](std::vector<std::string> options) {
        const TemporaryFolder words;
        std::vector<std::string> command = {"--wall", "1x1",     "--size", "96x54",     "--frames",
                                            "2",      "--scene", field,    "--journal", journal};
        command.insert(command.end(), options.begin(), options.end());
        ThreadServer server(words.path(), command);
        std::optional<ThreadHost> host;
        if (const auto address = server.waitForText("listening on ", 20s))
            host.emplace(words.path(),
                         ThreadHost::Options{.server = *parseAddress(*address), .name = "all", .surface = "none"});
        const std::optional<int> exit = server.waitForExit(60s);
        return Outcome{exit.value_or(-1), server.output()};
    };
    const Outcome first = frames({"--up", "z", "--fit", "3"});
    EXPECT_EQ(first.exitCode, 0) << first.output;
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
