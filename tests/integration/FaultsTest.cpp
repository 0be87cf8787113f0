/// The others when the process of one host is killed, its GPU goes, or it draws slowly. Other faults of hosts are in
/// tests/wall.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "tests/integration/ThreadWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

const json* findFault(const json& report, const std::string& host) {
    for (const json& fault : report["faults"])
        if (fault["host"] == host) return &fault;
    return nullptr;
}

class Faults : public testing::Test {
protected:
    /// A running 2x2 wall with all hosts past frame 5.
    void start(LiveWall& wall) {
        ASSERT_FALSE(wall.address().empty()) << wall.server().output();
        for (const std::string& host : kFourHosts) wall.startClient(host);
        for (const std::string& host : kFourHosts) ASSERT_TRUE(wall.waitForFrame(tileOf(host), 5, 30s)) << wall.logs();
    }
    /// The tiles but `host`'s go on by many frames while `host`'s stands still.
    void expectOnlyFrozen(LiveWall& wall, const std::string& host) {
        const std::int64_t frozen = wall.shownFrame(tileOf(host));
        for (const std::string& other : kFourHosts) {
            if (other == host) continue;
            EXPECT_TRUE(wall.waitForFrame(tileOf(other), frozen + 30, 15s)) << other << "\n" << wall.logs();
        }
        EXPECT_EQ(wall.shownFrame(tileOf(host)), frozen);
    }
};

TEST_F(Faults, KillingOneClientFreezesOnlyItsTileAndARestartedOneComesBack) {
    LiveWall wall({});
    start(wall);
    wall.client("upper-left").signal(SIGKILL);
    ASSERT_EQ(wall.client("upper-left").waitForExit(5s), 128 + SIGKILL);
    expectOnlyFrozen(wall, "upper-left");
    const std::int64_t frozen = wall.shownFrame(tileOf("upper-left"));
    wall.startClient("upper-left");
    EXPECT_TRUE(wall.waitForFrame(tileOf("upper-left"), frozen + 31, 15s)) << wall.logs();
    const json report = wall.finish();
    ASSERT_FALSE(report.is_null()) << wall.logs();
    const json* fault = findFault(report, "upper-left");
    ASSERT_TRUE(fault) << report.dump(2);
    // The system gives back the memory of the dead before it closes their links. That may take longer than the wall
    // waits for a word.
    EXPECT_TRUE((*fault)["kind"] == "disconnected" || (*fault)["kind"] == "silent") << fault->dump();
    EXPECT_TRUE((*fault)["rejoined_ms"].is_number());
    EXPECT_EQ(report["faults"].size(), 1u) << report["faults"].dump(2);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    for (const std::string& host : kFourHosts) EXPECT_EQ(wall.client(host).waitForExit(1s), 0) << wall.logs();
}

TEST_F(Faults, AGpuThatGoesAwayEndsItsHostInWordsAndTheOthersGoOn) {
    LiveWall wall({});
    const std::string gone = wall.folder() + "/gone";
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    const auto onEgl = [&](const std::string& host, const std::string& says) {
        return Process(wall.folder(), host + "-" + says,
                       {"/usr/bin/env", std::string("LD_LIBRARY_PATH=") + TESSERA_LOST_GPU_DIR,
                        "TESSERA_GPU_LOST_WHEN=" + gone, "TESSERA_GPU_LOST_SAYS=" + says, program("tessera-client"),
                        "--server", wall.address(), "--host", host, "--output", wall.output(), "--surface", "egl"});
    };
    Process first = onEgl("upper-left", "error"), second = onEgl("upper-right", "status");
    for (const char* host : {"lower-left", "lower-right"}) wall.startClient(host);
    for (const std::string& host : kFourHosts)
        ASSERT_TRUE(wall.waitForFrame(tileOf(host), 5, 30s)) << first.output() << second.output() << wall.logs();
    std::ofstream(gone) << "";
    // What stands still needs no drawing.
    EXPECT_EQ(wall.ctl({"view", "--position", "0.5", "1", "3"}).exitCode, 0);
    for (Process* host : {&first, &second}) {
        const auto exit = host->waitForExit(15s);
        ASSERT_TRUE(exit) << host->output();
        EXPECT_EQ(*exit, 1) << host->output();
        EXPECT_NE(host->output().find("the GPU was reset, or is gone"), std::string::npos) << host->output();
    }
    const std::int64_t frozen = wall.shownFrame(tileOf("upper-left"));
    for (const char* host : {"lower-left", "lower-right"})
        EXPECT_TRUE(wall.waitForFrame(tileOf(host), frozen + 30, 15s)) << wall.logs();
    // Another GPU, or none: the host comes back.
    wall.startClient("upper-left");
    EXPECT_TRUE(wall.waitForFrame(tileOf("upper-left"), frozen + 31, 15s)) << wall.logs();
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
    const json* fault = findFault(report, "upper-left");
    ASSERT_TRUE(fault) << report.dump(2);
    EXPECT_TRUE((*fault)["rejoined_ms"].is_number());
}

ThreadHost::Options slowAt(const std::string& injection) {
    return {.injection = *parseInjection(injection)};
}

TEST_F(Faults, ASlowHostIsNamedWithTheReason) {
    ThreadWall wall({.server = {"--frames", "40"}});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "lower-right" ? slowAt("draw-slow@20:1500") : ThreadHost::Options{});
    const json report = wall.waitForEnd(60s);
    ASSERT_FALSE(report["sync"]["waits"].empty()) << report.dump(2);
    const json& worst = report["sync"]["waits"][0];
    EXPECT_EQ(worst["host"], "lower-right") << report["sync"].dump(2);
    EXPECT_EQ(worst["tile"], tileOf("lower-right"));
    EXPECT_EQ(worst["reason"], "stood_still") << worst.dump(2);
    EXPECT_GT(worst["longest_ms"], 500);
    std::uint64_t frames = 0;
    for (const json& row : report["sync"]["waits"]) frames += row["frames"].get<std::uint64_t>();
    EXPECT_EQ(frames, 40u) << "each frame has one that was waited for";
}

TEST_F(Faults, APictureIsWaitedForAsLongAsHostsDraw) {
    const TemporaryFolder folder;
    ThreadWall wall({.wall = wallWithSync(folder, "frame_deadline_ms: 30000 lost_after_ms: 15000")});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "lower-left"    ? slowAt("draw-slow@20:4000")
                               : host == "lower-right" ? slowAt("draw-slow@21:4000")
                                                       : ThreadHost::Options{});
    ASSERT_TRUE(wall.waitForFrame(tileOf("upper-left"), 19, 60s)) << wall.logs();
    // Asked in frame 20 it is of frame 21: eight seconds later.
    const Outcome taken = wall.ctl({"snapshot", folder.path() + "/wall.png"});
    EXPECT_EQ(taken.exitCode, 0) << taken.output;
    const std::size_t of = taken.output.find("frame 2");
    EXPECT_NE(of, std::string::npos) << taken.output << ": 21, or on a busy machine a later one";
    EXPECT_EQ(taken.output.find("black"), std::string::npos) << taken.output;
    EXPECT_TRUE(wall.finish()["faults"].empty());
}

}  // namespace
}  // namespace tessera::test
