/// What happens to the others when one host goes: killed, stopped, hung, late, corrupted; and that it comes back.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <thread>

#include "common/application/Application.h"
#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"
#include "tests/integration/LiveWall.h"

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
    EXPECT_EQ((*fault)["kind"], "disconnected");
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

TEST_F(Faults, AStoppedClientIsNoticedByItsSilenceAndRejoinsWhenItGoesOn) {
    LiveWall wall({.wall = "2x2"});
    start(wall);
    wall.client("lower-right").signal(SIGSTOP);
    ASSERT_TRUE(wall.server().waitForText("lower-right: silent", 10s)) << wall.logs();
    expectOnlyFrozen(wall, "lower-right");
    const std::int64_t frozen = wall.shownFrame(tileOf("lower-right"));
    wall.client("lower-right").signal(SIGCONT);
    EXPECT_TRUE(wall.waitForFrame(tileOf("lower-right"), frozen + 31, 15s)) << wall.logs();
    const json report = wall.finish();
    const json* fault = findFault(report, "lower-right");
    ASSERT_TRUE(fault) << wall.logs();
    EXPECT_EQ((*fault)["kind"], "silent");
    EXPECT_GE((*fault)["detected_ms"].get<double>(), 800);
    EXPECT_LE((*fault)["detected_ms"].get<double>(), 5'000);
    EXPECT_TRUE((*fault)["rejoined_ms"].is_number());
}

TEST_F(Faults, AHostComesBackAfterAnEditWithArraysWasRefused) {
    LiveWall wall({});
    start(wall);
    auto application = Application::connect({.address = wall.address(), .name = "broken mesh"});
    ASSERT_TRUE(application) << application.error().message;
    MeshArrays mesh = makeBox({1, 1, 1}).toArrays();
    const std::vector<std::uint32_t> beyond = {0, 1, 99};
    mesh.indices = Blob::of(std::span<const std::uint32_t>(beyond));
    ChangeListBuilder edits;
    const ObjectId geometry(kFirstPlaceholder);
    edits.create(geometry, typeOf<Geometry>());
    setField<&Geometry::positions>(edits, geometry, mesh.positions);
    setField<&Geometry::indices>(edits, geometry, mesh.indices);
    const auto refused = (*application)->propose(edits.take());
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("vertex 99"), std::string::npos) << refused.error().message;

    wall.client("upper-left").signal(SIGKILL);
    ASSERT_EQ(wall.client("upper-left").waitForExit(5s), 128 + SIGKILL);
    const std::int64_t frozen = wall.shownFrame(tileOf("upper-left"));
    wall.startClient("upper-left");
    EXPECT_TRUE(wall.waitForFrame(tileOf("upper-left"), frozen + 31, 15s)) << wall.logs();
    EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
}

TEST_F(Faults, AHungDrawThreadIsFoundBehindItsHeartbeats) {
    const TemporaryFolder folder;
    LiveWall wall(
        {.wall = wallWithSync(folder, "late_frame: WAIT frame_deadline_ms: 700 heartbeat_ms: 50 lost_after_ms: 4000")});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "lower-left" ? std::vector<std::string>{"--inject", "draw-hang@20"}
                                                    : std::vector<std::string>{});
    ASSERT_TRUE(wall.server().waitForText("lower-left: draw-stalled", 40s)) << wall.logs();
    expectOnlyFrozen(wall, "lower-left");
    EXPECT_LT(wall.shownFrame(tileOf("lower-left")), 20);
    wall.client("lower-left").signal(SIGKILL);  // it would hang on
    const json report = wall.finish();
    const json* fault = findFault(report, "lower-left");
    ASSERT_TRUE(fault) << wall.logs();
    EXPECT_EQ((*fault)["kind"], "draw-stalled");
    EXPECT_EQ((*fault)["frame"], 20);
}

TEST_F(Faults, AHostThatOnlyClaimsToBeAliveHoldsTheWallUpOnceAndIsOut) {
    LiveWall wall({.wall = "2x2"});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "lower-left" ? std::vector<std::string>{"--inject", "show-hang@20"}
                                                    : std::vector<std::string>{});
    ASSERT_TRUE(wall.server().waitForText("lower-left: not-shown", 40s)) << wall.logs();
    expectOnlyFrozen(wall, "lower-left");
    EXPECT_EQ(wall.shownFrame(tileOf("lower-left")), 19);
    const json report = wall.finish();
    const json* fault = findFault(report, "lower-left");
    ASSERT_TRUE(fault) << wall.logs();
    EXPECT_EQ((*fault)["kind"], "not-shown");
    EXPECT_EQ((*fault)["frame"], 20);
    EXPECT_TRUE((*fault)["rejoined_ms"].is_null()) << "it came in again, to hold the others up again";
    EXPECT_EQ(report["faults"].size(), 1u) << report["faults"].dump(2);
    EXPECT_EQ(report["sync"]["worst_skew_frames"], 0) << "nobody went on before it was out";
}

TEST_F(Faults, ASlowHostIsNamedWithTheReason) {
    LiveWall wall({.server = {"--frames", "40"}});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "lower-right" ? std::vector<std::string>{"--inject", "draw-slow@20:1500"}
                                                     : std::vector<std::string>{});
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
    LiveWall wall({.wall = wallWithSync(folder, "frame_deadline_ms: 30000 lost_after_ms: 15000")});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "lower-left"    ? std::vector<std::string>{"--inject", "draw-slow@20:4000"}
                               : host == "lower-right" ? std::vector<std::string>{"--inject", "draw-slow@21:4000"}
                                                       : std::vector<std::string>{});
    ASSERT_TRUE(wall.waitForFrame(tileOf("upper-left"), 19, 60s)) << wall.logs();
    // Asked in frame 20 it is of frame 21: eight seconds later.
    const Outcome taken = wall.ctl({"snapshot", folder.path() + "/wall.png"});
    EXPECT_EQ(taken.exitCode, 0) << taken.output;
    const std::size_t of = taken.output.find("frame 2");
    EXPECT_NE(of, std::string::npos) << taken.output << ": 21, or on a busy machine a later one";
    EXPECT_EQ(taken.output.find("black"), std::string::npos) << taken.output;
    EXPECT_TRUE(wall.finish()["faults"].empty());
}

TEST_F(Faults, ALateHostEntersAtANamedFrame) {
    const TemporaryFolder folder;
    LiveWall wall({.wall = wallWithSync(folder, "late_frame: WAIT start_deadline_ms: 1500 lost_after_ms: 4000")});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const char* host : {"upper-left", "lower-right", "lower-left"}) wall.startClient(host);
    const auto missing = wall.server().waitForText("starting without: ", 30s);
    ASSERT_TRUE(missing) << wall.logs();
    EXPECT_NE(missing->find("upper-right"), std::string::npos);
    ASSERT_TRUE(wall.waitForFrame(tileOf("upper-left"), 10, 30s)) << wall.logs();
    wall.startClient("upper-right");
    const auto entered = wall.server().waitForText("upper-right enters at frame ", 30s);
    ASSERT_TRUE(entered) << wall.logs();
    EXPECT_GE(std::stoi(*entered), 10);
    EXPECT_TRUE(wall.waitForFrame(tileOf("upper-right"), std::stoi(*entered) + 5, 15s)) << wall.logs();
    const json report = wall.finish();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

TEST_F(Faults, ACorruptedReplicaIsNamedAndRepairedWhileTheWallGoesOn) {
    LiveWall wall({});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(host, host == "upper-right" ? std::vector<std::string>{"--inject", "corrupt@15"}
                                                     : std::vector<std::string>{});
    const auto found = wall.server().waitForText("upper-right: first differing object: ", 40s);
    ASSERT_TRUE(found) << wall.logs();
    EXPECT_NE(found->find("differs"), std::string::npos) << *found;
    const std::int64_t then = wall.shownFrame(tileOf("upper-left"));
    EXPECT_TRUE(wall.waitForFrame(tileOf("upper-right"), then + 20, 15s)) << wall.logs();
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 1) << report.dump(2);
    EXPECT_GE(report["replication"]["resnapshots"].get<int>(), 1);
    const json* fault = findFault(report, "upper-right");
    ASSERT_TRUE(fault);
    EXPECT_EQ((*fault)["kind"], "state-mismatch");
    EXPECT_EQ((*fault)["frame"], 15);
}

TEST_F(Faults, AHostThatLiesInEachFrameIsSentAwayInWordsAndTheOthersGoOn) {
    LiveWall wall({});
    ASSERT_FALSE(wall.address().empty()) << wall.server().output();
    for (const std::string& host : kFourHosts)
        wall.startClient(
            host, host == "upper-right" ? std::vector<std::string>{"--inject", "lie@15"} : std::vector<std::string>{});
    const auto exit = wall.client("upper-right").waitForExit(40s);
    ASSERT_TRUE(exit) << wall.logs();
    EXPECT_EQ(*exit, 1) << wall.client("upper-right").output();
    EXPECT_NE(wall.client("upper-right").output().find("as 3 times within 60 s; it is sent away"), std::string::npos)
        << wall.client("upper-right").output();
    EXPECT_TRUE(wall.server().waitForText(
        "upper-right: no object differs; only the hash that it said of them all is wrong", 5s))
        << wall.logs();
    expectOnlyFrozen(wall, "upper-right");
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 3) << report.dump(2);
    const json* fault = nullptr;
    for (const json& one : report["faults"])
        if (one["host"] == "upper-right") fault = &one;
    ASSERT_TRUE(fault);
    EXPECT_EQ((*fault)["kind"], "state-mismatch");
    EXPECT_NE((*fault)["detail"].get<std::string>().find("sent away"), std::string::npos) << fault->dump();
}

TEST_F(Faults, ARestartedServerGetsItsClientsBackWithANewScene) {
    auto first = std::make_unique<LiveWall>(LiveWallOptions{});
    start(*first);
    const std::string address = first->address();
    first->server().signal(SIGKILL);
    ASSERT_TRUE(first->server().waitForExit(5s));
    const TemporaryFolder folder;
    Process second(folder.path(), "server",
                   {program("tessera-server"), "--wall", "2x2", "--scene",
                    std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct", "--listen", address, "--size",
                    "160x90", "--samples", "1", "--frames", "40", "--report", folder.path() + "/report.json"});
    EXPECT_EQ(second.waitForExit(60s), 0) << second.output() << first->logs();
    for (const std::string& host : kFourHosts) EXPECT_EQ(first->client(host).waitForExit(5s), 0) << first->logs();
    const json report = json::parse(readText(folder.path() + "/report.json"));
    EXPECT_EQ(report["frames"], 40);
}

}  // namespace
}  // namespace tessera::test
