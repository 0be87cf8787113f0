/// A machine that starts no thread for a while: what needs one is refused in words or waits, and the wall goes on.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <optional>
#include <system_error>

#include "common/base/LaneThreads.h"
#include "common/base/Workers.h"
#include "common/codec/MessageCodec.h"
#include "common/net/TcpTransport.h"
#include "server/sim/recording/RecordingWriter.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/wall/ThreadShortage.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;

const std::string kRooms = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery";

class ThreadShortages : public testing::Test {
    void SetUp() override {
        if (!ThreadShortage::kRefuses) GTEST_SKIP() << "a sanitizer stands where threads are refused";
    }
};

TEST_F(ThreadShortages, ALoadIsRefusedAndLaterDone) {
    AskedWall wall({.wall = "1x1", .scene = kYard, .server = {"--allow", kRooms}});
    const std::vector<std::string> load = {"load", kRooms + "/rooms/lantern.tsct"};
    {
        const ThreadShortage shortage;
        EXPECT_WORDS(wall.refused(load));
        wall.settle();
    }
    EXPECT_EQ(wall.ctl(load).exitCode, 0);
}

TEST_F(ThreadShortages, AFilmWaitsAndPlaysLater) {
    AskedWall wall({.wall = "1x1", .scene = kRooms + "/1b-movie.tsct"});
    const auto film = [&]() -> nlohmann::json {
        const nlohmann::json told = wall.ask({"animations"});
        for (const nlohmann::json& entry : told["animations"])
            if (entry["kind"] == "Movie") return entry;
        return {};
    };
    wall.tell({"set", "/film", "file", "/none/such.avi"});
    for (int i = 0; i < 100 && film()["problem"] == ""; ++i) wall.settle();
    {
        const ThreadShortage shortage;
        wall.tell({"set", "/film", "file", kRooms + "/film.avi"});
        wall.settle();
        EXPECT_WORDS(film()["problem"].get<std::string>());
    }
    for (int i = 0; i < 100 && film()["problem"] != ""; ++i) wall.settle();
    EXPECT_EQ(film()["problem"], "");
}

TEST_F(ThreadShortages, AFileThatChangesMeanwhileIsReadLater) {
    const test::TestFolder folder;
    const std::string scene = folder.write("scene.tsct", "node { name: \"first\" transform {} }\n");
    SimulatedWall wall({.scene = scene, .wall = "1x1", .draws = false, .reload = true});
    const SimulatedApplication& watcher = wall.application();
    const auto isThere = [&] { return findNode(watcher.scene(), "/second").has_value(); };
    wall.world().runFor(1s);
    {
        const ThreadShortage shortage;
        (void)folder.write("scene.tsct",
                           "node { name: \"first\" transform {} }\nnode { name: \"second\" transform {} }\n");
        wall.world().runFor(10s);
        EXPECT_FALSE(isThere());
    }
    EXPECT_TRUE(wall.world().runUntil(isThere, 20s)) << wall.logs();
}

const std::string kFirst = "node { name: \"first\" transform {} }\n";
const std::string kSecond = "node { name: \"second\" transform {} }\n";

/// The thread of a load starts; then its pipe, the importer, or a file that it reads, finds no descriptor.
TEST(DescriptorShortages, AFileThatChangesMeanwhileIsReadLater) {
    for (int room = 0; room < 8; ++room) {
        const test::TestFolder folder;
        const std::string scene = folder.write("scene.tsct", kFirst);
        SimulatedWall wall({.scene = scene, .wall = "1x1", .draws = false, .reload = true});
        const SimulatedApplication& watcher = wall.application();
        const auto isThere = [&] { return findNode(watcher.scene(), "/second").has_value(); };
        wall.world().runFor(1s);
        const std::string next = folder.write("next.tsct", kFirst + kSecond);
        {
            const DescriptorShortage shortage(room);
            std::filesystem::rename(next, scene);
            wall.world().runFor(10s);
        }
        EXPECT_TRUE(wall.world().runUntil(isThere, 20s)) << "room for " << room << ": " << wall.logs();
    }
}

TEST_F(ThreadShortages, AFileOfAWallThatBeginsAgainIsReadLater) {
    const test::TestFolder folder;
    const std::string scene = folder.write("scene.tsct", kFirst);
    const WallOptions options{
        .scene = scene, .wall = "1x1", .draws = false, .journal = folder / "journal", .reload = true};
    { SimulatedWall(options).world().runFor(1s); }
    std::optional<SimulatedWall> wall;
    {
        const ThreadShortage shortage;
        wall.emplace(options);
        wall->world().runFor(5s);
    }
    wall->world().runFor(10s);
    const SimulatedApplication& watcher = wall->application();
    wall->world().runFor(1s);
    (void)folder.write("scene.tsct", kFirst + kSecond);
    EXPECT_TRUE(wall->world().runUntil([&] { return findNode(watcher.scene(), "/second").has_value(); }, 20s))
        << wall->logs();
}

TEST_F(ThreadShortages, FewerWorkersDoAllTheWork) {
    for (const int room : {0, 1, 2}) {
        const ThreadShortage shortage(room);
        Workers workers(4);
        EXPECT_EQ(workers.threads(), static_cast<unsigned>(room) + 1);
        std::atomic<int> done = 0;
        workers.run(100, [&](std::size_t) { ++done; });
        EXPECT_EQ(done, 100);
    }
}

TEST_F(ThreadShortages, ALaneOfFewerThreadsDoesAllTheWorkAndOneOfNoneIsRefused) {
    std::atomic<int> done = 0;
    {
        const ThreadShortage shortage(1);
        LaneThreads lane({.width = 3});
        for (int i = 0; i < 100; ++i) lane.post([&] { ++done; });
        lane.finish();
    }
    EXPECT_EQ(done, 100);
    const ThreadShortage shortage;
    EXPECT_THROW(LaneThreads({.width = 3}), std::system_error);
}

/// Its threads that have begun end before that is said.
TEST_F(ThreadShortages, ATransportThatCannotBeginLeavesNothingBehind) {
    for (const int room : {0, 1}) {
        const ThreadShortage shortage(room);
        EXPECT_THROW(TcpTransport({.tls = [] { return nullptr; }, .maxPayload = maxPayloadBytes}, [](LinkEvent) {}),
                     std::system_error);
    }
}

TEST_F(ThreadShortages, ARecordingEndsInWordsAndTheWallGoesOn) {
    const test::TestFolder folder;
    test::ReadableLog words;
    auto recording = RecordingWriter::create(folder / "short.rec", {}, words.log);
    ASSERT_TRUE(recording);
    words.log.info("the log has its thread");
    words.log.flush();
    {
        const ThreadShortage shortage;
        (*recording)->frameBegins(FrameNumber(0), true, {}, {});
    }
    (*recording)->frameBegins(FrameNumber(1), false, {}, {});
    EXPECT_WORDS(words.said());
}

}  // namespace
}  // namespace tessera::simulation
