/// The application's door from outside: a program of at most 60 lines, built against the installed package alone, moves
/// the crane of a running wall while another follows it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

const std::string kOutside = std::string(TESSERA_SOURCE_DIR) + "/tests/data/outside";

/// A value that this build was configured with.
std::string cacheValue(const std::string& name) {
    std::istringstream cache(readText(std::filesystem::path(TESSERA_BIN_DIR).parent_path() / "CMakeCache.txt"));
    for (std::string line; std::getline(cache, line);)
        if (line.starts_with(name + ":")) return line.substr(line.find('=') + 1);
    return {};
}

/// Installs the package into `folder` and builds the program there, from a copy, with nothing of this tree in sight.
std::string buildOutside(const std::string& folder) {
    const std::string cmake = cacheValue("CMAKE_COMMAND");
    const auto step = [&](std::vector<std::string> words) {
        words.insert(words.begin(), cmake);
        const Outcome outcome = run(folder, words, 240s);
        EXPECT_EQ(outcome.exitCode, 0) << words[1] << "\n" << outcome.output;
        return outcome.exitCode == 0;
    };
    const std::string build = std::filesystem::path(TESSERA_BIN_DIR).parent_path();
    std::filesystem::create_directory(folder + "/source");
    for (const char* file : {"CMakeLists.txt", "main.cpp"})
        std::filesystem::copy_file(kOutside + "/" + file, folder + "/source/" + file);
    const std::string sanitize = cacheValue("TESSERA_SANITIZE");
    const bool built = step({"--install", build, "--prefix", folder + "/installed", "--component", "application"}) &&
                       step({"-S", folder + "/source", "-B", folder + "/build", "-G", cacheValue("CMAKE_GENERATOR"),
                             "-DCMAKE_PREFIX_PATH=" + folder + "/installed",
                             "-DCMAKE_CXX_COMPILER=" + cacheValue("CMAKE_CXX_COMPILER"),
                             "-DCMAKE_CXX_FLAGS=" + (sanitize.empty() ? "" : "-fsanitize=" + sanitize)}) &&
                       step({"--build", folder + "/build"});
    return built ? folder + "/build/outside" : "";
}

/// Where the follower has seen the node, in order.
std::vector<std::string> placesIn(const std::string& output) {
    std::vector<std::string> places;
    std::istringstream in(output);
    for (std::string line; std::getline(in, line);)
        if (const std::size_t at = line.find(" is at "); at != std::string::npos) places.push_back(line.substr(at + 7));
    return places;
}

TEST(OutsideProgram, IsShort) {
    const std::string text = readText(kOutside + "/main.cpp");
    EXPECT_GT(text.size(), 0u);
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 60);
}

TEST(OutsideProgram, MovesTheCraneWhileAnotherFollows) {
    const TemporaryFolder folder;
    const std::string outside = buildOutside(folder.path());
    ASSERT_FALSE(outside.empty());

    LiveWall wall({.wall = "1x1", .scene = kOutside + "/crane.tsct"});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    wall.startClient("all");
    ASSERT_TRUE(wall.waitForFrame("front-0-0", 3, 30s)) << wall.logs();

    Process follower(folder.path(), "follower", {outside, wall.address(), "follower", "/hall/crane", "3"});
    ASSERT_TRUE(follower.waitForText("/hall/crane is at 1 2 -3", 20s)) << follower.output();
    const Outcome mover = run(folder.path(), {outside, wall.address(), "mover", "/hall/crane", "2", "8"}, 30s);
    EXPECT_EQ(mover.exitCode, 0) << mover.output;
    EXPECT_NE(mover.output.find("step 8 of 8"), std::string::npos) << mover.output;
    EXPECT_EQ(follower.waitForExit(20s).value_or(-1), 0) << follower.output();

    const std::vector<std::string> expected = {"1 2 -3",    "1.25 2 -3", "1.5 2 -3",  "1.75 2 -3", "2 2 -3",
                                               "2.25 2 -3", "2.5 2 -3",  "2.75 2 -3", "3 2 -3"};
    EXPECT_EQ(placesIn(follower.output()), expected) << "every step, once, in order";
    // The hook reaches 0.25 to either side of the crane, the post stands from 1.95 to 2.05: they meet from 1.7 to 2.3.
    // What happens in a frame is told after where that frame leads.
    const std::string told = follower.output();
    const std::size_t touches = told.find("/hall/crane touches /hall/post"),
                      leaves = told.find("/hall/crane leaves /hall/post");
    ASSERT_TRUE(touches != std::string::npos && leaves != std::string::npos) << told;
    EXPECT_GT(touches, told.find("is at 1.75 2 -3"));
    EXPECT_LT(touches, told.find("is at 2 2 -3")) << told;
    EXPECT_GT(leaves, told.find("is at 2.5 2 -3")) << told;

    const json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump(2);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

/// The rule of common/application/README.md: a hand on a node pauses the motion that drives it.
TEST(TwoWantOneNode, AProposalPausesTheMotionAndSettingItPlaysOn) {
    ThreadWall wall({.wall = "1x1", .scene = kOutside + "/crane.tsct"});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    wall.startClient("all");
    ASSERT_TRUE(wall.waitForFrame("front-0-0", 3, 30s)) << wall.logs();
    const auto cart = [&] {
        const Outcome tree = wall.ctl({"--json", "tree", "/hall/cart"});
        return json::parse(tree.output, nullptr, false)["core"]["translation"][0].get<double>();
    };
    const auto waitFrames = [&](std::int64_t more) {
        return wall.waitForFrame("front-0-0", wall.shownFrame("front-0-0") + more, 30s);
    };
    const double before = cart();
    ASSERT_TRUE(waitFrames(10));
    EXPECT_NE(cart(), before) << "it drives by its timetable";

    EXPECT_EQ(wall.ctl({"move", "/hall/cart", "5", "0", "0"}).exitCode, 0);
    ASSERT_TRUE(waitFrames(10));
    EXPECT_EQ(cart(), 5) << "the hand holds it";
    EXPECT_NE(wall.ctl({"--json", "tree", "/timetable"}).output.find("\"playing\": false"), std::string::npos);

    EXPECT_EQ(wall.ctl({"set", "/timetable", "playing", "1"}).exitCode, 0);
    ASSERT_TRUE(waitFrames(10));
    EXPECT_LT(cart(), 0) << "it drives again";
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::test
