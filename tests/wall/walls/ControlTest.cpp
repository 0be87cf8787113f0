/// Every verb of tessera-ctl on a live wall.
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/image/Picture.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

class Control : public testing::Test {
protected:
    Control() : wall_({.scene = kYard, .widthPx = 160, .heightPx = 90, .server = {"--allow", models_.path()}}) {}
    json ask(std::vector<std::string> words) { return wall_.ask(std::move(words)); }
    void TearDown() override { (void)wall_.finish(); }
    Picture snapshot(const std::string& name) {
        const std::string path = wall_.folder() + "/" + name;
        const CommandOutcome outcome = wall_.ctl({"snapshot", path});
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
        const Expected<Bytes> bytes = readFile(path, 64 << 20);
        if (!bytes) return {};
        const Expected<DecodedPng> png = decodePng(*bytes);
        return png ? png->picture : Picture{};
    }
    test::TestFolder models_;  ///< what load may read
    AskedWall wall_;
};

TEST_F(Control, StatusNamesTheHostsAndTheFrame) {
    const json status = ask({"status"});
    EXPECT_EQ(status["hosts"].size(), 4u);
    for (const json& host : status["hosts"]) EXPECT_EQ(host["state"], "live") << status.dump(2);
    ASSERT_FALSE(status["waits"].empty()) << status.dump(2);
    EXPECT_GT(status["wait_frames"], 0);
    EXPECT_FALSE(status["waits"][0]["reason"].get<std::string>().empty());
    const CommandOutcome plain = wall_.ctl({"status"});
    EXPECT_EQ(plain.exitCode, 0);
    for (const auto& [name, host] : wall_.hosts())
        EXPECT_NE(plain.output.find(name), std::string::npos) << plain.output;
}

TEST_F(Control, TreeShowsNodesAndAnUnknownNodeIsToldWhatIsThere) {
    const CommandOutcome tree = wall_.ctl({"tree"});
    for (const char* name : {"floor", "post", "carriage", "body"})
        EXPECT_NE(tree.output.find(name), std::string::npos) << tree.output;
    const CommandOutcome missing = wall_.ctl({"tree", "/carriag"});
    EXPECT_EQ(missing.exitCode, 3) << missing.output;
    EXPECT_WORDS(missing.output);
}

TEST_F(Control, MoveIsSeenOnTheWallAndUndoTakesItBack) {
    // The carriage drives for a second; then the yard stands still.
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    const Picture before = snapshot("before.png");
    ASSERT_GT(before.widthPx, 0);
    EXPECT_EQ(wall_.ctl({"move", "/row[0]", "0", "1.5", "0", "--by"}).exitCode, 0);
    const Picture moved = snapshot("moved.png");
    EXPECT_FALSE(moved == before);
    EXPECT_EQ(wall_.ctl({"undo"}).exitCode, 0);
    EXPECT_TRUE(snapshot("after.png") == before);
    EXPECT_EQ(wall_.ctl({"redo"}).exitCode, 0);
    EXPECT_TRUE(snapshot("again.png") == moved);
    EXPECT_WORDS(wall_.ctl({"redo"}).output);
    EXPECT_EQ(wall_.ctl({"undo"}).exitCode, 0);
    EXPECT_TRUE(snapshot("after.png") == before);
    const CommandOutcome nothing = wall_.ctl({"undo"});
    EXPECT_EQ(nothing.exitCode, 1) << nothing.output;
    EXPECT_WORDS(nothing.output);
}

TEST_F(Control, AMoveIntoThePostIsStoppedAndContactsSayWhere) {
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    const json moved = ask({"move", "/carriage", "8", "0.5", "0"});
    EXPECT_FALSE(moved["stopped"].empty()) << moved.dump(2);
    const json contacts = ask({"contacts"});
    ASSERT_FALSE(contacts["contacts"].empty()) << contacts.dump(2);
    // Far away again, nothing touches.
    (void)ask({"move", "/carriage", "-2", "0.5", "0"});
    EXPECT_TRUE(ask({"contacts"})["contacts"].empty());
}

TEST_F(Control, ViewMovesTheWallThroughTheWorldAndResets) {
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    const Picture before = snapshot("before.png");
    EXPECT_EQ(wall_.ctl({"view", "--position", "1", "1", "5"}).exitCode, 0);
    EXPECT_FALSE(snapshot("moved.png") == before);
    EXPECT_EQ(wall_.ctl({"view", "--reset"}).exitCode, 0);
    EXPECT_TRUE(snapshot("after.png") == before);
    EXPECT_EQ(wall_.ctl({"view", "--head", "viewer", "0.4", "1.5", "2"}).exitCode, 0);
    EXPECT_FALSE(snapshot("head.png") == before);
    const CommandOutcome behind = wall_.ctl({"view", "--head", "viewer", "0", "1.5", "-2"});
    EXPECT_EQ(behind.exitCode, 3) << behind.output;
}

TEST_F(Control, LoadAddsAFileAndRemoveTakesItAway) {
    const std::string file = models_.write(
        "pyramid.obj",
        "v 0 1 0\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 2 5\nf 2 3 4 5\n");
    const json loaded = ask({"load", file});
    EXPECT_EQ(loaded["triangles"], 6) << loaded.dump(2);
    EXPECT_NE(wall_.ctl({"tree"}).output.find("pyramid"), std::string::npos);
    EXPECT_EQ(wall_.ctl({"remove", "/pyramid"}).exitCode, 0);
    EXPECT_EQ(wall_.ctl({"tree", "/pyramid"}).exitCode, 3);
    EXPECT_EQ(wall_.ctl({"undo"}).exitCode, 0);
    EXPECT_EQ(wall_.ctl({"tree", "/pyramid"}).exitCode, 0);
}

TEST_F(Control, LoadReadsNothingOutsideTheFoldersThatTheServerAllows) {
    const test::TestFolder elsewhere;
    const std::string file = elsewhere.write("pyramid.obj", "v 0 1 0\nv -1 0 -1\nv 1 0 -1\nf 1 3 2\n");
    const std::string link = models_.path() + "/link.obj";
    std::filesystem::create_symlink(file, link);
    const std::string name = std::filesystem::path(elsewhere.path()).filename().string();
    for (const std::string& path : {file, link, models_.path() + "/../" + name + "/pyramid.obj",
                                    elsewhere.path() + "/nothing.obj", std::string("/etc/shadow")}) {
        const CommandOutcome refused = wall_.ctl({"load", path});
        EXPECT_EQ(refused.exitCode, 1) << path << ": " << refused.output;
        EXPECT_WORDS(refused.output);
    }
    EXPECT_EQ(wall_.ctl({"load", models_.path() + "/nothing.obj"}).exitCode, 3) << "here it may say what is not there";
    EXPECT_EQ(wall_.ctl({"tree", "/pyramid"}).exitCode, 3);
}

TEST_F(Control, PickNamesWhatIsUnderAPixel) {
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    // The lowest row of the picture is floor.
    const json hit = ask({"pick", "80", "88"});
    EXPECT_EQ(hit["hit"], true) << hit.dump(2);
    EXPECT_EQ(hit["path"].get<std::string>().rfind("/floor", 0), 0u) << hit.dump(2);
}

TEST_F(Control, GetTellsTheBoxInTheWorldOfANode) {
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    const json before = ask({"get", "/row[0]", "bounds"});
    ASSERT_TRUE(before["bounds"].is_object()) << before.dump();
    EXPECT_EQ(before["path"], "/row[0]");
    EXPECT_EQ(wall_.ctl({"move", "/row[0]", "0", "1.5", "0", "--by"}).exitCode, 0);
    const json after = ask({"get", "/row[0]", "bounds"});
    for (int axis = 0; axis < 3; ++axis)
        for (const char* end : {"lower", "upper"})
            EXPECT_NEAR(after["bounds"][end][axis].get<double>() - before["bounds"][end][axis].get<double>(),
                        axis == 1 ? 1.5 : 0, 1e-9)
                << end << axis;
    // What holds all holds this.
    const json all = ask({"get", "/", "bounds"});
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_LE(all["bounds"]["lower"][axis], after["bounds"]["lower"][axis]);
        EXPECT_GE(all["bounds"]["upper"][axis], after["bounds"]["upper"][axis]);
    }
    EXPECT_NE(wall_.ctl({"get", "/row[0]", "bounds"}).output.find(" large"), std::string::npos);
    EXPECT_EQ(wall_.ctl({"get", "/nothing", "bounds"}).exitCode, 3);
}

TEST_F(Control, MeasureTellsHowFarAPlaceIsFromANode) {
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    EXPECT_EQ(ask({"measure", "1,2,3", "1,5,7"})["distance"], 5);
    const json hit = ask({"pick", "80", "88"});
    std::vector<std::string> place;
    for (std::size_t i = 0; i < 3; ++i)
        place.push_back(fmt::format("{}", hit["point"][i].get<double>() + 0.125 * hit["normal"][i].get<double>()));
    const json told = ask({"measure", fmt::format("{}", fmt::join(place, ",")), hit["path"].get<std::string>()});
    EXPECT_NEAR(told["distance"].get<double>(), 0.125, 1e-9) << told.dump(2);
    EXPECT_EQ(told["path"], hit["path"]);
    EXPECT_EQ(told["error"], 0);
    EXPECT_EQ(wall_.ctl({"measure", "0,0,0", "/nowhere"}).exitCode, 3);
    EXPECT_EQ(wall_.ctl({"measure", "/floor", "/floor"}).exitCode, 2);
}

TEST_F(Control, SaveWritesAFileThatShowsTheSameWall) {
    // The carriage drives for a second; then the yard stands still.
    ASSERT_TRUE(wall_.waitForFrame(90)) << wall_.logs();
    EXPECT_EQ(wall_.ctl({"move", "/row[0]", "0", "1.5", "0", "--by"}).exitCode, 0);
    const Picture before = snapshot("before.png");
    for (const std::string name : {"yard.tsc", "yard.tsct"}) {
        const std::string file = wall_.folder() + "/" + name;
        const json saved = ask({"save", file});
        EXPECT_GT(saved["bytes"], 1000) << saved.dump();
        AskedWall again({.scene = file, .widthPx = 160, .heightPx = 90});
        const std::string picture = wall_.folder() + "/" + name + ".png";
        ASSERT_EQ(again.ctl({"snapshot", picture}).exitCode, 0);
        const Expected<Bytes> bytes = readFile(picture, 64 << 20);
        ASSERT_TRUE(bytes);
        const Expected<DecodedPng> png = decodePng(*bytes);
        ASSERT_TRUE(png);
        EXPECT_TRUE(png->picture == before) << name;
        (void)again.finish();
    }
    // A link is followed, as by other programs of a person's; where it led is said.
    const std::string link = wall_.folder() + "/link.tsc";
    std::filesystem::create_symlink("yard.tsc", link);
    EXPECT_EQ(ask({"save", link})["target"], std::filesystem::canonical(wall_.folder() + "/yard.tsc").string());
    const CommandOutcome nowhere = wall_.ctl({"save", wall_.folder() + "/none/yard.tsc"});
    EXPECT_EQ(nowhere.exitCode, 1) << nowhere.output;
    EXPECT_WORDS(nowhere.output);
}

/// An edit waits for the first frame, and whoever waits is told so at once.
TEST(ControlWithoutHosts, AnEditSaysWhatItWaitsForAndIsDoneOnceTheyDraw) {
    AskedWall wall({.scene = kYard, .widthPx = 160, .heightPx = 90, .starts = false});
    const TimePoint begun = wall.world().now();
    const CommandOutcome alone = wall.ctl({"--timeout", "2", "set", "/row[0]", "translation", "0", "7", "0"});
    EXPECT_LT(wall.world().now() - begun, 8s);
    EXPECT_EQ(alone.exitCode, 4) << alone.output;
    for (const WallHost& host : wall.wall().hosts)
        EXPECT_NE(alone.output.find(host.name + ": absent"), std::string::npos) << alone.output;
    EXPECT_NE(alone.output.find("tessera-client --server " + toString(wall.address())), std::string::npos);
    EXPECT_NE(alone.output.find("is done with the first frame"), std::string::npos) << alone.output;
    wall.start();
    const CommandOutcome there = wall.ctl({"get", "/row[0]", "translation"});
    EXPECT_EQ(there.output, "0 7 0\n");
    const CommandOutcome again = wall.ctl({"set", "/row[0]", "translation", "0", "1", "0"});
    EXPECT_EQ(again.exitCode, 0) << again.output;
    EXPECT_EQ(again.output.find("no host"), std::string::npos) << again.output;
    (void)wall.finish();
}

}  // namespace
}  // namespace tessera::simulation
