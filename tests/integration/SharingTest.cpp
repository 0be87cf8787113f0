/// Real hosts that draw parts of each other's tiles, while some of them are stopped and killed in the middle; arrays
/// that they have in common.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>

#include "common/image/Picture.h"
#include "tests/integration/LiveWall.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/Sanitized.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

/// Tiles by frame number, as --keep-frames leaves them.
class Sharing : public testing::Test {
protected:
    static Bytes tile(const LiveWall& wall, const std::string& host, int frame) {
        char name[32];
        std::snprintf(name, sizeof name, "/%06d.png", frame);
        const auto bytes = readFile(wall.output() + "/tiles/" + tileOf(host) + name, 100 << 20);
        return bytes ? *bytes : Bytes();
    }
    /// All frames of all hosts, drawn alone.
    static std::unique_ptr<LiveWall> drawnAlone(int frames) {
        auto wall = std::make_unique<LiveWall>(options(frames));
        for (const std::string& host : kFourHosts) wall->startClient(host, {"--keep-frames", "--share", "off"});
        const json report = wall->waitForEnd(120s);
        EXPECT_EQ(report["frames"], frames) << wall->logs();
        return wall;
    }
    static std::uint64_t sumOf(const json& report, const std::string& field) {
        std::uint64_t sum = 0;
        for (const json& row : report["tiles"]) sum += row[field].get<std::uint64_t>();
        return sum;
    }
    static LiveWallOptions options(int frames) {
        return {.size = "640x400", .server = {"--frames", std::to_string(frames)}};
    }
};

TEST_F(Sharing, EachFrameOfEachTileIsTheOneThatItsHostDrawsAlone) {
    constexpr int kFrames = 30;
    const auto alone = drawnAlone(kFrames);
    LiveWall wall(options(kFrames));
    for (const std::string& host : kFourHosts) wall.startClient(host, {"--keep-frames", "--share", "always"});
    const json report = wall.waitForEnd(120s);
    ASSERT_EQ(report["frames"], kFrames) << wall.logs();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump();
    // Tiles in which nothing changes are not drawn again.
    EXPECT_GT(sumOf(report, "divided"), static_cast<std::uint64_t>(kFrames)) << report["tiles"].dump(2);
    EXPECT_GT(sumOf(report, "parts_helped"), 0u) << report["tiles"].dump(2);
    for (const std::string& host : kFourHosts)
        for (int frame = 0; frame < kFrames; ++frame) {
            const Bytes expected = tile(*alone, host, frame);
            ASSERT_FALSE(expected.empty()) << host << " " << frame;
            ASSERT_TRUE(tile(wall, host, frame) == expected) << host << " " << frame;
        }
}

/// Two screens at an angle, both eyes, two tiles for one host: the last picture of each tile.
TEST_F(Sharing, EyesCornersAndSeveralTilesOfAHostComeOutAsDrawnAlone) {
    const TemporaryFolder folder;
    const std::string wall = folder.write("corner.wall", R"(
screens { name: "front" lower_left { x: -1.2 y: 0 z: 0 } lower_right { x: 1.2 y: 0 z: 0 }
  upper_left { x: -1.2 y: 2.4 z: 0 }
  grid { columns: 1 rows: 1 tile_width_px: 300 tile_height_px: 300 } }
screens { name: "left" lower_left { x: -1.2 y: 0 z: 2.4 } lower_right { x: -1.2 y: 0 z: 0 }
  upper_left { x: -1.2 y: 2.4 z: 2.4 }
  grid { columns: 1 rows: 1 tile_width_px: 300 tile_height_px: 300 } }
users { name: "viewer" position { x: 0 y: 1.7 z: 1.4 } }
hosts { name: "both" tiles { screen: "front" column: 0 row: 0 eye: LEFT user: "viewer" }
  tiles { screen: "front" column: 0 row: 0 eye: RIGHT user: "viewer" } }
hosts { name: "side" tiles { screen: "left" column: 0 row: 0 eye: LEFT user: "viewer" } }
hosts { name: "other" tiles { screen: "left" column: 0 row: 0 eye: RIGHT user: "viewer" } }
)");
    std::map<std::string, json> reports;
    for (const char* share : {"off", "always"}) {
        const std::string out = folder.path() + "/" + share;
        const Outcome outcome = run(folder.path(),
                                    {program("tessera-wall"), "--wall", wall, "--scene",
                                     std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct", "--frames", "15",
                                     "--keep-frames", "--share", share, "--output", out},
                                    120s);
        ASSERT_EQ(outcome.exitCode, 0) << outcome.output;
        reports[share] = json::parse(readText(out + "/report.json"));
    }
    EXPECT_GT(sumOf(reports["always"], "parts_helped"), 0u) << reports["always"]["tiles"].dump(2);
    EXPECT_EQ(sumOf(reports["off"], "divided"), 0u);
    ASSERT_EQ(reports["off"]["tiles"].size(), 4u);
    for (const json& row : reports["off"]["tiles"])
        for (const char* frame : {"/000000.png", "/000007.png", "/000014.png"}) {
            const std::string file = "/tiles/" + row["tile"].get<std::string>() + frame;
            const std::string alone = readText(folder.path() + "/off" + file);
            ASSERT_FALSE(alone.empty()) << file;
            EXPECT_TRUE(readText(folder.path() + "/always" + file) == alone) << file;
        }
}

TEST_F(Sharing, HostsThatAreStoppedAndKilledInTheMiddleSpoilNoPictureOfTheOthers) {
    const unsigned seed =
        std::getenv("TESSERA_SEED") ? static_cast<unsigned>(std::stoul(std::getenv("TESSERA_SEED"))) : 1;
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) + " build/bin/integration --gtest_filter=Sharing.Hosts*");
    constexpr int kFrames = 150;
    const auto alone = drawnAlone(kFrames);
    LiveWall wall(options(kFrames));
    const std::vector<std::string> words = {"--keep-frames", "--share", "always"};
    for (const std::string& host : kFourHosts) wall.startClient(host, words);
    std::mt19937 random(seed);
    const auto below = [&](int n) { return std::uniform_int_distribution<>(0, n - 1)(random); };
    const std::string steady = kFourHosts[0];
    ASSERT_TRUE(wall.waitForFrame(tileOf(steady), 3, 60s)) << wall.logs();
    for (int trouble = 0; trouble < 8 && wall.shownFrame(tileOf(steady)) < kFrames - 20; ++trouble) {
        const std::string host = kFourHosts[static_cast<std::size_t>(1 + below(3))];
        aMoment(random, 60ms);  // any instant of a frame
        if (below(2)) {
            wall.client(host).signal(SIGSTOP);
            aMoment(random, 600ms);  // no frame comes meanwhile: the wall waits for it, and it is not lost yet
            wall.client(host).signal(SIGCONT);
        } else {
            wall.client(host).signal(SIGKILL);
            (void)wall.client(host).waitForExit(5s);
            wall.startClient(host, words);
        }
        const std::int64_t now = wall.shownFrame(tileOf(steady));
        ASSERT_TRUE(wall.waitForFrame(tileOf(steady), std::min<std::int64_t>(now + 6, kFrames - 1), 30s))
            << wall.logs();
    }
    const json report = wall.waitForEnd(120s);
    ASSERT_EQ(report["frames"], kFrames) << wall.logs();
    EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0) << report["faults"].dump(2);
    EXPECT_GT(sumOf(report, "parts_helped"), 0u) << report["tiles"].dump(2);
    int compared = 0;
    for (const std::string& host : kFourHosts)
        for (int frame = 0; frame < kFrames; ++frame) {
            const Bytes shown = tile(wall, host, frame);
            if (shown.empty() && host != steady) continue;  // it was away
            ASSERT_TRUE(shown == tile(*alone, host, frame)) << host << " " << frame;
            ++compared;
        }
    EXPECT_GT(compared, 2 * kFrames);
}

/// Of each process' arrays in memory in common: the places where they lie.
std::set<std::uint64_t> placesOf(pid_t process) {
    std::set<std::uint64_t> places;
    std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
    for (std::string line; std::getline(maps, line);) {
        unsigned long node = 0;
        if (line.find("/memfd:tessera-array ") != std::string::npos &&
            std::sscanf(line.c_str(), "%*s %*s %*s %*s %lu", &node) == 1)
            places.insert(node);
    }
    return places;
}

TEST_F(Sharing, WhereAddressesOrOpenFilesAreFewAHostDrawsAlone) {
    if (kSanitized) GTEST_SKIP() << "sanitizers want many addresses";
    for (const std::string limit : {"-v 600000", "-n 24"}) {
        LiveWall wall({.wall = "1x1", .server = {"--frames", "3"}});
        Process client(wall.folder(), "limited",
                       {"/bin/bash", "-c", "ulimit " + limit + "; exec \"$0\" \"$@\"", program("tessera-client"),
                        "--server", wall.address(), "--host", "all", "--share", "auto"});
        EXPECT_EQ(client.waitForExit(60s), 0) << limit << ": " << client.output();
        EXPECT_NE(client.output().find("nothing is shared with hosts of this machine"), std::string::npos)
            << client.output();
    }
}

TEST_F(Sharing, WhereFilesMayNotBeLargeHostsDrawAlone) {
    const TemporaryFolder folder;
    // In blocks of 1,024 bytes: less than a board takes, more than a tile's pictures.
    const Outcome drawn =
        run(folder.path(),
            {"/bin/bash", "-c", "ulimit -f 20000; exec \"$0\" \"$@\"", program("tessera-wall"), "--wall", "2x2",
             "--scene", std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/yard.tsct", "--frames", "5", "--size",
             "320x180", "--output", folder.path() + "/out"},
            120s);
    EXPECT_EQ(drawn.exitCode, 0) << drawn.output;
    EXPECT_NE(drawn.output.find(", 0 faults"), std::string::npos) << drawn.output;
    EXPECT_NE(drawn.output.find("warning"), std::string::npos) << "what is gone without is said\n" << drawn.output;
}

/// Twelve balls of 130,000 triangles that differ a little: 36 large arrays.
TEST_F(Sharing, ArraysLieOnceInTheMemoryOfAMachineAndAreFetchedOnce) {
    const TemporaryFolder folder;
    std::string scene = "node { transform { translation { z: -9 } }\n";
    for (int i = 0; i < 12; ++i)
        scene += "  node { transform { translation { x: " + std::to_string(i - 6) +
                 " } } sphere { radius: 0.4 segments: " + std::to_string(256 + i) + " } }\n";
    LiveWallOptions options{
        .scene = folder.write("balls.tsct", scene + "}\n"), .size = "320x200", .server = {"--rate", "20"}};
    for (const bool shared : {true, false}) {
        LiveWall wall(options);
        for (const std::string& host : kFourHosts)
            wall.startClient(host, shared ? std::vector<std::string>{} : std::vector<std::string>{"--share", "off"});
        for (const std::string& host : kFourHosts) ASSERT_TRUE(wall.waitForFrame(tileOf(host), 2, 60s)) << wall.logs();
        std::set<std::uint64_t> all;
        std::size_t arrays = 0;
        for (const std::string& host : kFourHosts) {
            const std::set<std::uint64_t> places = placesOf(wall.client(host).pid());
            arrays = std::max(arrays, places.size());
            all.insert(places.begin(), places.end());
        }
        // One who joins finds them all, the others' ends or not.
        if (shared) {
            EXPECT_GE(arrays, 24u);
            // Of hosts that have fetched the same at the same instant each may keep its own: four that start together
            // do so with few.
            EXPECT_LE(4 * all.size(), 5 * arrays) << "most are there once";
            wall.client(kFourHosts[0]).signal(SIGKILL);
            ASSERT_TRUE(wall.client(kFourHosts[0]).waitForExit(10s));
            wall.startClient(kFourHosts[0]);
            ASSERT_TRUE(wall.waitForFrame(tileOf(kFourHosts[0]), wall.shownFrame(tileOf(kFourHosts[1])) + 2, 60s))
                << wall.logs();
            std::set<std::uint64_t> found = placesOf(wall.client(kFourHosts[0]).pid());
            EXPECT_GE(found.size(), arrays - 1);
            std::erase_if(found, [&](std::uint64_t place) { return all.contains(place); });
            EXPECT_TRUE(found.empty()) << "who comes back takes what is there";
        } else {
            EXPECT_TRUE(all.empty());
        }
        const json report = wall.finish();
        EXPECT_EQ(report["replication"]["state_hash_mismatches"], 0) << report["faults"].dump(2);
    }
}

/// Metered light, frame by frame, from the first on: what is metered of one counts for the next, whoever has drawn
/// which part.
TEST(SharedExposure, EachFrameIsTheSameHoweverItsPartsAreShared) {
    constexpr int kFrames = 6;
    std::map<std::string, std::map<std::string, Picture>> files;
    std::uint64_t helped = 0;
    for (const char* const share : {"off", "always"}) {
        LiveWall wall({.scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/sunlit.glb",
                       .size = "640x400",
                       .server = {"--frames", std::to_string(kFrames)}});
        for (const std::string& host : kFourHosts) wall.startClient(host, {"--keep-frames", "--share", share});
        const json report = wall.waitForEnd(120s);
        ASSERT_EQ(report["frames"], kFrames) << wall.logs();
        EXPECT_EQ(report["exposure"]["changes"], 1) << "a still scene is found at once";
        for (const json& row : report["tiles"]) helped += row["parts"].get<std::uint64_t>();
        for (const std::string& host : kFourHosts)
            for (int frame = 0; frame < kFrames; ++frame) {
                const std::string name = fmt::format("{}/{:06}.png", tileOf(host), frame);
                const auto bytes = readFile(wall.output() + "/tiles/" + name, 100 << 20);
                ASSERT_TRUE(bytes) << name;
                // Beside its pixels a file has the frame's number.
                const auto picture = decodePng(*bytes);
                ASSERT_TRUE(picture) << name;
                files[share][name] = picture->picture;
            }
    }
    EXPECT_GT(helped, 0u);
    for (const auto& [name, picture] : files["off"]) EXPECT_TRUE(files["always"][name] == picture) << name;
    const std::string first = tileOf(kFourHosts.front());
    EXPECT_FALSE(files["off"][first + "/000000.png"] == files["off"][first + "/000001.png"]);
    EXPECT_TRUE(files["off"][first + "/000001.png"] == files["off"][first + "/000005.png"]) << "at rest";
}

}  // namespace
}  // namespace tessera::test
