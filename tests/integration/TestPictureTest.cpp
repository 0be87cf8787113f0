/// The test picture on whole walls: every shipped one, from separate processes; and all tiles change in one frame.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <map>

#include "client/testpicture/TestPicture.h"
#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

std::vector<std::string> shippedWallNames() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(TESSERA_SOURCE_DIR "/deploy/walls"))
        if (entry.path().extension() == ".wall") names.push_back(entry.path().stem().string());
    return names;
}

Picture pictureIn(const std::string& path) {
    const Expected<Bytes> bytes = readFile(path, 100 << 20);
    if (!bytes) {
        ADD_FAILURE() << bytes.error().message;
        return {};
    }
    return decodePng(*bytes).value().picture;
}

TEST(TestPictures, AreShownByEveryShippedWallTileByTile) {
    for (const std::string& name : shippedWallNames()) {
        SCOPED_TRACE(name);
        TemporaryFolder folder;
        const Wall plain = loadWall(TESSERA_SOURCE_DIR "/deploy/walls/" + name + ".wall").value();
        const auto screens = static_cast<int>(plain.screens.size());
        const Wall wall = withSize(plain, 120 * screens, 90).value();
        const Outcome outcome =
            run(folder.path(),
                {program("tessera-wall"), "--wall", name, "--test-picture", "--frames", "2", "--size",
                 fmt::format("{}x90", 120 * screens), "--samples", "1", "--output", folder.path() + "/out"},
                120s);
        ASSERT_EQ(outcome.exitCode, 0) << outcome.output;
        for (const Tile& tile : layoutTiles(wall))
            EXPECT_TRUE(pictureIn(folder.path() + "/out/tiles/" + tile.name + "/000001.png") == testPicture(wall, tile))
                << tile.name;
        EXPECT_TRUE(fs::exists(folder.path() + "/out/wall.png"));
    }
}

TEST(TestPictures, ComeAndGoOnAllTilesInOneFrame) {
    LiveWall live({});
    ASSERT_FALSE(live.address().empty());
    for (const std::string& host : kFourHosts) live.startClient(host, {"--keep-frames"});
    ASSERT_TRUE(live.waitForFrame("front-0-0", 5, 60s)) << live.logs();
    const auto show = [&](std::vector<std::string> words) {
        words.insert(words.begin(), "show");
        const Outcome outcome = live.ctl(words);
        EXPECT_EQ(outcome.exitCode, 0) << outcome.output;
        const std::int64_t now = live.shownFrame("front-0-0");
        EXPECT_TRUE(live.waitForFrame("front-0-0", now + 6, 60s)) << live.logs();
    };
    show({"test-picture"});
    show({"scene"});
    show({"test-picture", "--count"});
    show({"test-picture"});
    show({"scene"});
    const nlohmann::json report = live.finish();
    EXPECT_TRUE(report["faults"].empty()) << report["faults"].dump();

    const Wall wall = withSize(loadWall(TESSERA_SOURCE_DIR "/deploy/walls/2x2.wall").value(), 160, 90).value();
    std::map<int, std::map<std::string, int>> shown;  // 0: the scene, 1: the still picture, 2: the counted one
    for (const Tile& tile : layoutTiles(wall)) {
        const Picture still = testPicture(wall, tile);
        for (const auto& entry : fs::directory_iterator(live.output() + "/tiles/" + tile.name)) {
            if (entry.path().extension() != ".png") continue;
            const int frame = std::stoi(entry.path().stem().string());
            const Picture picture = pictureIn(entry.path());
            const bool counted = picture == testPicture(wall, tile, {.frame = static_cast<std::uint64_t>(frame)});
            shown[frame][tile.name] = picture == still ? 1 : counted ? 2 : 0;
        }
    }
    int changes = 0, before = 0;
    for (const auto& [frame, tiles] : shown) {
        for (const auto& [tile, what] : tiles) EXPECT_EQ(what, tiles.begin()->second) << tile << " in frame " << frame;
        changes += tiles.begin()->second != before;
        before = tiles.begin()->second;
    }
    EXPECT_EQ(changes, 5);
    EXPECT_EQ(before, 0);

    // What is shown of the scene in between and afterwards is what a wall shows that has never shown anything else.
    TemporaryFolder folder;
    const Outcome plain =
        run(folder.path(),
            {program("tessera-wall"), "--wall", "2x2", "--scene", TESSERA_SOURCE_DIR "/tests/data/scenes/yard.tsct",
             "--size", "160x90", "--samples", "1", "--frames", std::to_string(shown.rbegin()->first + 1),
             "--keep-frames", "--output", folder.path()},
            120s);
    ASSERT_EQ(plain.exitCode, 0) << plain.output;
    int scenes = 0;
    for (const auto& [frame, tiles] : shown)
        for (const auto& [tile, what] : tiles) {
            if (what != 0) continue;
            const std::string file = fmt::format("/tiles/{}/{:06}.png", tile, frame);
            EXPECT_TRUE(pictureIn(live.output() + file) == pictureIn(folder.path() + file)) << file;
            ++scenes;
        }
    EXPECT_GT(scenes, 20);
}

TEST(TestPictures, AreRefusedInWords) {
    TemporaryFolder folder;
    const auto says = [&](std::vector<std::string> words, const std::string& what) {
        const Outcome outcome = run(folder.path(), words, 30s);
        EXPECT_EQ(outcome.exitCode, 2) << outcome.output;
        EXPECT_NE(outcome.output.find(what), std::string::npos) << outcome.output;
    };
    says({program("tessera-ctl"), "--server", "127.0.0.1:1", "show", "film"}, "film");
    says({program("tessera-ctl"), "--server", "127.0.0.1:1", "show", "scene", "--count"},
         "--count is for the test picture");
}

}  // namespace
}  // namespace tessera::test
