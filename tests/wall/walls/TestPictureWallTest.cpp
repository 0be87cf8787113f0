/// The test picture on whole walls: on the shipped ones tile by tile; and all tiles change in one frame.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "client/testpicture/TestPicture.h"
#include "common/codec/WallCodec.h"
#include "common/image/SharedFrame.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> shippedWallNames() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(TESSERA_SOURCE_DIR "/deploy/walls"))
        if (entry.path().extension() == ".wall") names.push_back(entry.path().stem().string());
    return names;
}

TEST(TestPictures, AreShownByEveryShippedWallTileByTile) {
    for (const std::string& name : shippedWallNames()) {
        SCOPED_TRACE(name);
        const Wall plain = loadWall(TESSERA_SOURCE_DIR "/deploy/walls/" + name + ".wall").value();
        SimulatedWall wall({.wall = name,
                            .widthPx = 120 * static_cast<int>(plain.screens.size()),
                            .heightPx = 90,
                            .server = {"--test-picture", "--samples", "1"}});
        ASSERT_TRUE(wall.world().runUntil([&] { return wall.shownFrame() >= 1u; }, 60s)) << wall.logs();
        for (const Tile& tile : layoutTiles(wall.wall()))
            EXPECT_TRUE(wall.tilePicture(tile.name) == testPicture(wall.wall(), tile)) << tile.name;
    }
}

TEST(TestPictures, ComeAndGoOnAllTilesInOneFrame) {
    static constexpr std::uint64_t kFrames = 90;
    enum class Content : std::uint8_t { kScene, kStill, kCounted };
    // The pictures of each frame that was shown.
    const auto film = [](SimulatedWall& wall, const std::function<void(std::uint64_t)>& onFrame) {
        std::map<std::uint64_t, std::map<std::string, Picture>> pictures;
        const std::vector<Tile> tiles = layoutTiles(wall.wall());
        (void)wall.world().runUntil(
            [&] {
                for (const Tile& tile : tiles)
                    if (const auto shown = readSharedFrame(wall.folder() + "/out/tiles/" + tile.name + "/shown.frame"))
                        pictures[shown->frame].try_emplace(tile.name, shown->picture);
                const auto frame = wall.shownFrame();
                if (frame && onFrame) onFrame(*frame);
                return frame >= kFrames;
            },
            60s);
        return pictures;
    };
    AskedWall wall({.scene = kYard, .widthPx = 160, .heightPx = 90});
    SimulatedApplication& application = wall.application();
    const std::array<std::pair<std::uint64_t, Showing>, 5> shows = {{{10, Showing::kTestPicture},
                                                                     {20, Showing::kScene},
                                                                     {30, Showing::kCountedTestPicture},
                                                                     {40, Showing::kTestPicture},
                                                                     {50, Showing::kScene}}};
    std::size_t said = 0;
    const auto pictures = film(wall, [&](std::uint64_t frame) {
        if (said < shows.size() && frame >= shows[said].first)
            (void)application.say(request::ShowPicture{shows[said++].second});
    });
    SimulatedWall plain({.scene = kYard, .widthPx = 160, .heightPx = 90, .server = {"--samples", "1"}});
    const auto scenes = film(plain, {});

    int changes = 0, compared = 0;
    Content before = Content::kScene;
    for (const auto& [frame, tiles] : pictures) {
        std::map<std::string, Content> what;
        for (const Tile& tile : layoutTiles(wall.wall())) {
            const auto shown = tiles.find(tile.name);
            if (shown == tiles.end()) continue;
            what[tile.name] = shown->second == testPicture(wall.wall(), tile)                     ? Content::kStill
                              : shown->second == testPicture(wall.wall(), tile, {.frame = frame}) ? Content::kCounted
                                                                                                  : Content::kScene;
            // The scene looks as on a wall that has shown nothing else.
            const auto other = scenes.find(frame);
            if (what[tile.name] != Content::kScene || other == scenes.end() || !other->second.contains(tile.name))
                continue;
            EXPECT_TRUE(shown->second == other->second.at(tile.name)) << tile.name << " in frame " << frame;
            ++compared;
        }
        for (const auto& [tile, each] : what) EXPECT_EQ(each, what.begin()->second) << tile << " in frame " << frame;
        changes += what.begin()->second != before ? 1 : 0;
        before = what.begin()->second;
    }
    EXPECT_EQ(changes, 5);
    EXPECT_EQ(before, Content::kScene);
    EXPECT_GT(compared, 20);
}

TEST(TestPictures, AreRefusedInWords) {
    AskedWall wall({.wall = "1x1", .scene = kYard});
    EXPECT_WORDS(wall.refused({"show", "film"}));
    EXPECT_WORDS(wall.refused({"show", "scene", "--count"}));
}

}  // namespace
}  // namespace tessera::simulation
