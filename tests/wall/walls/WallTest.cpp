/// A whole wall in one process (tests/support/wall): what the wall shows, and that a seed decides all of it.
#include <gtest/gtest.h>

#include "common/request/Requests.h"
#include "tests/support/wall/SimulatedWall.h"

namespace tessera::simulation {
namespace {

/// A carriage drives into a post within the first second.
const std::string kYard = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct";

std::string message(const auto& expected) {
    return expected ? std::string() : expected.error().message;
}

ObjectId nodeAt(SimulatedApplication& application, const std::string& path) {
    const Expected<ObjectId> found = findNode(application.scene(), path);
    EXPECT_TRUE(found) << message(found);
    return found.value_or(ObjectId{});
}

request::MoveNode moved(SimulatedApplication& application, const std::string& path, const Vec3d& by) {
    return {.node = nodeAt(application, path), .move = {.translation = by, .relative = true}};
}

TEST(SimulatedWall, TwoByTwoShowsWhatOneByOneShowsWhileItMoves) {
    SimulatedWall four({.scene = kYard, .wall = "2x2"}), one({.scene = kYard, .wall = "1x1", .seed = 2});
    Picture before;
    for (const std::uint64_t frame : {0, 20, 45, 90}) {
        const Picture picture = four.pictureOf(frame);
        EXPECT_EQ(picture, one.pictureOf(frame)) << "frame " << frame;
        if (frame != 90) EXPECT_NE(picture, before) << "frame " << frame;  // the carriage stands by then
        before = picture;
    }
}

TEST(SimulatedWall, AnEditLeadsToTheSamePictureOnEveryWallUnderEveryCuller) {
    std::optional<Picture> expected;
    for (const auto& [wall, culler] : std::initializer_list<std::pair<const char*, CullerKind>>{
             {"1x1", CullerKind::kAuto}, {"2x2", CullerKind::kAuto}, {"2x2", CullerKind::kTwoPhase}}) {
        SimulatedWall shown({.scene = kYard, .wall = wall, .culler = culler});
        SimulatedApplication& application = shown.application();
        (void)shown.pictureOf(150);  // the carriage stands
        const auto done = application.ask(moved(application, "/row[1]/ball", {0, 0.7, 0}));
        ASSERT_TRUE(done) << message(done);
        const std::uint64_t frame = *shown.shownFrame() + 3;
        const Picture picture = shown.pictureOf(frame);
        if (!expected) expected = picture;
        EXPECT_EQ(picture, *expected) << wall;
    }
}

TEST(SimulatedWall, ASeedDecidesAllThatHappens) {
    const auto fingerprint = [](std::uint64_t seed) {
        SimulatedWall wall({.scene = kYard, .wall = "1x1", .seed = seed});
        SimulatedApplication& application = wall.application();
        (void)wall.pictureOf(10);
        EXPECT_TRUE(application.ask(moved(application, "/row[1]/ball", {0, 0.2, 0})));
        (void)wall.pictureOf(40);
        return wall.world().network().fingerprint();
    };
    const std::uint64_t first = fingerprint(1);  // who compiles GL's programs first is slower, and the same
    EXPECT_EQ(fingerprint(1), first);
    EXPECT_NE(fingerprint(1), fingerprint(2));
}

TEST(SimulatedWall, AHostThatDiesHangsOrIsCutOffComesBackAndTheOthersGoOn) {
    SimulatedWall wall({.scene = kYard, .wall = "2x2"});
    (void)wall.pictureOf(5);
    wall.killHost("upper-left");
    wall.world().runFor(3s);
    EXPECT_TRUE(wall.serverLives()) << wall.serverError();
    EXPECT_EQ(wall.shownFrame(), std::nullopt) << "the others have gone on";
    wall.startHost("upper-left");
    EXPECT_TRUE(wall.world().runUntil([&] { return wall.shownFrame().has_value(); }, 20s)) << wall.logs();
    wall.host("lower-left").drawing().hang(true);
    wall.world().runFor(15s);
    wall.host("lower-left").drawing().hang(false);
    EXPECT_TRUE(wall.world().runUntil([&] { return wall.shownFrame().has_value(); }, 20s)) << wall.logs();
    wall.world().network().cutOff("lower-right", true);
    wall.world().runFor(5s);
    EXPECT_EQ(wall.shownFrame(), std::nullopt);
    wall.world().network().cutOff("lower-right", false);
    EXPECT_TRUE(wall.world().runUntil([&] { return wall.shownFrame().has_value(); }, 20s)) << wall.logs();
    EXPECT_TRUE(wall.serverLives()) << wall.serverError();
}

TEST(SimulatedWall, AKilledServerGoesOnFromItsJournalWithAllThatWasGranted) {
    test::TestFolder folder;
    SimulatedWall wall({.scene = kYard, .wall = "1x1", .journal = folder / "journal"});
    SimulatedApplication& before = wall.application();
    (void)wall.pictureOf(70);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(before.ask(moved(before, "/row[1]/ball", {0, 0.1, 0})));
    const StateHash state = before.scene().stateHash();
    wall.killServer();
    wall.world().runFor(1s);
    wall.startServer();
    SimulatedApplication& after = wall.application("after");
    EXPECT_EQ(after.scene().stateHash(), state);
    EXPECT_TRUE(wall.world().runUntil([&] { return wall.shownFrame() > 80; }, 20s)) << wall.logs();
    const auto undone = after.ask(request::UndoStep{});
    EXPECT_TRUE(undone) << message(undone);
}

TEST(SimulatedWall, EndsInOrderAndAllHostsWithIt) {
    SimulatedWall wall({.scene = kYard, .wall = "2x2", .frames = 20});
    EXPECT_TRUE(wall.world().runUntil([&] { return !wall.serverLives(); }, 60s));
    EXPECT_EQ(wall.serverError(), "");
    EXPECT_EQ(wall.shownFrame(), 19u);
    wall.world().runFor(1s);
    for (const auto& [name, host] : wall.hosts()) EXPECT_TRUE(host->ended()) << wall.logs();
}

}  // namespace
}  // namespace tessera::simulation
