/// The others when one host goes: killed, silent, hung, corrupted, lying; and how it comes back.
#include <gtest/gtest.h>

#include <fstream>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

using nlohmann::json;

const std::vector<std::string> kFourHosts = {"lower-left", "lower-right", "upper-left", "upper-right"};

/// The shipped 2x2 wall with other bounds.
std::string wallWithSync(const test::TestFolder& folder, const std::string& sync) {
    const std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/2x2.wall");
    return folder.write("2x2.wall", text.substr(0, text.find("sync {")) + "sync { " + sync + " }\n");
}

json faultsOf(const json& report, const std::string& host) {
    json found = json::array();
    for (const json& fault : report["faults"])
        if (fault["host"] == host) found.push_back(fault);
    return found;
}

class FaultyWall : public SimulatedWall {
public:
    explicit FaultyWall(std::map<std::string, Injection> injections = {}, const std::string& wall = "2x2",
                        std::vector<std::string> server = {})
        : SimulatedWall(
              {.scene = kYard, .wall = wall, .server = std::move(server), .injections = std::move(injections)}) {}

    [[nodiscard]] std::string tileOf(const std::string& host) const {
        for (const Tile& tile : layoutTiles(wall()))
            if (tile.host == host) return tile.name;
        return {};
    }
    [[nodiscard]] std::uint64_t frameOf(const std::string& host) const { return shownFrame(tileOf(host)).value_or(0); }
    [[nodiscard]] bool waitFor(const std::string& host, std::uint64_t frame) {
        return world().runUntil([&] { return frameOf(host) >= frame; }, 20s);
    }
    void start() {
        for (const std::string& host : kFourHosts) ASSERT_TRUE(waitFor(host, 5)) << logs();
    }
    /// The tiles but this host's go on by many frames while its own stands still.
    void expectOnlyFrozen(const std::string& host) {
        const std::uint64_t frozen = frameOf(host);
        for (const std::string& other : kFourHosts)
            if (other != host) {
                EXPECT_TRUE(waitFor(other, frozen + 30)) << other << "\n" << logs();
            }
        EXPECT_EQ(frameOf(host), frozen);
    }
};

TEST(Faults, OfAHostThatIsKilledFreezeItsTileAloneAndOneThatIsStartedAgainComesBack) {
    FaultyWall wall;
    wall.start();
    wall.killHost("upper-left");
    wall.expectOnlyFrozen("upper-left");
    const std::uint64_t frozen = wall.frameOf("upper-left");
    wall.startHost("upper-left");
    EXPECT_TRUE(wall.waitFor("upper-left", frozen + 31)) << wall.logs();
    const json report = wall.finish();
    const json faults = faultsOf(report, "upper-left");
    ASSERT_EQ(faults.size(), 1u) << report.dump(2);
    EXPECT_EQ(faults[0]["kind"], "disconnected");
    EXPECT_TRUE(faults[0]["rejoined_ms"].is_number());
    EXPECT_EQ(report["faults"].size(), 1u) << report["faults"].dump(2);
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

TEST(Faults, OfAStoppedHostAreNoticedByItsSilenceAndItRejoinsWhenItGoesOn) {
    FaultyWall wall;
    wall.start();
    const auto stop = [&wall](bool stops) {
        wall.world().network().cutOff("lower-right", stops);
        wall.host("lower-right").session().hang(stops);
        wall.host("lower-right").drawing().hang(stops);
    };
    stop(true);
    wall.world().runFor(2s);
    wall.expectOnlyFrozen("lower-right");
    const std::uint64_t frozen = wall.frameOf("lower-right");
    stop(false);
    EXPECT_TRUE(wall.waitFor("lower-right", frozen + 31)) << wall.logs();
    const json faults = faultsOf(wall.finish(), "lower-right");
    ASSERT_EQ(faults.size(), 1u) << wall.logs();
    EXPECT_EQ(faults[0]["kind"], "silent");
    EXPECT_GE(faults[0]["detected_ms"].get<double>(), 800);
    EXPECT_LE(faults[0]["detected_ms"].get<double>(), 1'000);
    EXPECT_TRUE(faults[0]["rejoined_ms"].is_number());
}

TEST(Faults, OfAHungDrawThreadAreFoundBehindItsHeartbeats) {
    const test::TestFolder folder;
    FaultyWall wall(
        {}, wallWithSync(folder, "late_frame: WAIT frame_deadline_ms: 700 heartbeat_ms: 50 lost_after_ms: 4000"));
    wall.start();
    wall.host("lower-left").drawing().hang(true);
    wall.world().runFor(1500ms);
    wall.expectOnlyFrozen("lower-left");
    const std::uint64_t frozen = wall.frameOf("lower-left");
    wall.killHost("lower-left");
    const json faults = faultsOf(wall.finish(), "lower-left");
    ASSERT_GE(faults.size(), 1u) << wall.logs();
    EXPECT_EQ(faults[0]["kind"], "draw-stalled");
    EXPECT_EQ(faults[0]["frame"], frozen + 1);
}

TEST(Faults, OfAHostThatOnlyClaimsToBeAliveHoldTheWallUpOnceAndItIsOut) {
    FaultyWall wall({{"lower-left", {.kind = Injection::Kind::kShowHang, .frame = 20}}});
    ASSERT_TRUE(wall.waitFor("upper-left", 40)) << wall.logs();
    wall.expectOnlyFrozen("lower-left");
    EXPECT_EQ(wall.frameOf("lower-left"), 19u);
    const json report = wall.finish();
    const json faults = faultsOf(report, "lower-left");
    ASSERT_EQ(faults.size(), 1u) << wall.logs();
    EXPECT_EQ(faults[0]["kind"], "not-shown");
    EXPECT_EQ(faults[0]["frame"], 20);
    EXPECT_TRUE(faults[0]["rejoined_ms"].is_null()) << "it came in again, to hold the others up again";
    EXPECT_EQ(report["faults"].size(), 1u) << report["faults"].dump(2);
    EXPECT_EQ(report["sync"]["worst_skew_frames"], 0) << "nobody went on before it was out";
}

TEST(Faults, OfAnEditWithArraysThatWasRefusedKeepNoHostFromComingBack) {
    FaultyWall wall;
    wall.start();
    MeshArrays mesh = makeBox({1, 1, 1}).toArrays();
    const std::vector<std::uint32_t> beyond = {0, 1, 99};
    mesh.indices = Blob::of(std::span<const std::uint32_t>(beyond));
    ChangeListBuilder edits;
    const ObjectId geometry(kFirstPlaceholder);
    edits.create(geometry, typeOf<Geometry>());
    setField<&Geometry::positions>(edits, geometry, mesh.positions);
    setField<&Geometry::indices>(edits, geometry, mesh.indices);
    SimulatedApplication& application = wall.application("broken mesh");
    const std::vector<Blob> arrays = {mesh.positions, mesh.indices};
    application.upload(arrays);
    request::ProposeChanges proposal;
    proposal.list = ByteSlice(encodeChangeList(edits.take()));
    const auto refused = application.ask(proposal);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);

    wall.killHost("upper-left");
    const std::uint64_t frozen = wall.frameOf("upper-left");
    wall.startHost("upper-left");
    EXPECT_TRUE(wall.waitFor("upper-left", frozen + 31)) << wall.logs();
    EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
}

TEST(Faults, OfALateHostAreNoneAndItEntersAtANamedFrame) {
    const test::TestFolder folder;
    SimulatedWall wall({.scene = kYard,
                        .wall = wallWithSync(folder, "late_frame: WAIT start_deadline_ms: 1500 lost_after_ms: 4000"),
                        .hosts = false});
    for (const char* host : {"upper-left", "lower-right", "lower-left"}) wall.startHost(host);
    wall.world().runFor(3s);
    EXPECT_NE(wall.logs().find("starting without: upper-right"), std::string::npos) << wall.logs();
    ASSERT_GE(wall.shownFrame("front-0-1").value_or(0), 10u) << wall.logs();
    wall.startHost("upper-right");
    wall.world().runFor(2s);
    const std::string said = "upper-right enters at frame ", logs = wall.logs();
    const std::size_t at = logs.find(said);
    ASSERT_NE(at, std::string::npos) << logs;
    const std::uint64_t entered = std::stoull(logs.substr(at + said.size()));
    EXPECT_GE(entered, 10u);
    EXPECT_GE(wall.shownFrame("front-1-1").value_or(0), entered + 5) << logs;
    const json report = wall.finish();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0);
}

TEST(Faults, OfACorruptedReplicaAreNamedAndRepairedWhileTheWallGoesOn) {
    FaultyWall wall({{"upper-right", {.kind = Injection::Kind::kCorrupt, .frame = 15}}});
    ASSERT_TRUE(wall.waitFor("upper-left", 60)) << wall.logs();
    EXPECT_NE(wall.logs().find("upper-right: first differing object: "), std::string::npos) << wall.logs();
    EXPECT_TRUE(wall.waitFor("upper-right", wall.frameOf("upper-left") + 20)) << wall.logs();
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 1) << report.dump(2);
    EXPECT_GE(report["replication"]["resnapshots"].get<int>(), 1);
    const json faults = faultsOf(report, "upper-right");
    ASSERT_GE(faults.size(), 1u);
    EXPECT_EQ(faults[0]["kind"], "state-mismatch");
    EXPECT_EQ(faults[0]["frame"], 15);
}

TEST(Faults, OfAHostThatLiesInEachFrameSendItAwayInWordsAndTheOthersGoOn) {
    FaultyWall wall({{"upper-right", {.kind = Injection::Kind::kLie, .frame = 15}}});
    ASSERT_TRUE(wall.world().runUntil([&] { return wall.host("upper-right").ended(); }, 40s)) << wall.logs();
    const std::string said = wall.host("upper-right").log();
    EXPECT_NE(said.find("as 3 times within 60 s; it is sent away"), std::string::npos) << said;
    EXPECT_NE(wall.logs().find("upper-right: no object differs; only the hash that it said of them all is wrong"),
              std::string::npos)
        << wall.logs();
    wall.expectOnlyFrozen("upper-right");
    const json report = wall.finish();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 3) << report.dump(2);
    const json faults = faultsOf(report, "upper-right");
    ASSERT_GE(faults.size(), 1u);
    EXPECT_EQ(faults.back()["kind"], "state-mismatch");
    EXPECT_WORDS(faults.back()["detail"].get<std::string>());
}

TEST(Faults, OfAServerThatIsStartedAgainWithoutAJournalEndWithANewScene) {
    FaultyWall wall;
    wall.start();
    wall.killServer();
    wall.startServer();
    ASSERT_TRUE(wall.world().runUntil(
        [&] { return wall.logs().find("upper-right enters at frame 0") != std::string::npos; }, 20s))
        << wall.logs();
    wall.world().runFor(2s);
    const json report = wall.finish();
    EXPECT_GE(report["frames"].get<int>(), 40);
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump();
}

}  // namespace
}  // namespace tessera::simulation
