/// Animations, skins and morph targets on walls: the same pictures on all, led by tessera-ctl.
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

const std::string kMoving = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/moving.tsct";

class AnimationWall : public AskedWall {
public:
    explicit AnimationWall(const std::string& wall, const std::string& scene = kMoving)
        : AskedWall({.wall = wall, .scene = scene}) {}
    void standAt(const char* seconds) {
        for (const char* node : {"/crawl", "/change", "/glow", "/swing"}) {
            tell({"pause", node});
            tell({"seek", node, seconds});
        }
    }
    [[nodiscard]] nlohmann::json named(const std::string& node) {
        const nlohmann::json told = ask({"animations"});
        for (const nlohmann::json& entry : told["animations"])
            if (entry["node"] == node) return entry;
        ADD_FAILURE() << node << " is not listed";
        return {};
    }
};

TEST(AnimationWall, TwoByTwoShowsWhatOneByOneShowsWhateverPlayedBefore) {
    Picture early, late;
    {
        AnimationWall wall("2x2");
        EXPECT_TRUE(wall.named("/crawl")["playing"]);
        EXPECT_EQ(wall.named("/crawl")["channels"], 50);
        EXPECT_EQ(wall.named("/crawl")["length"], 2.0);
        wall.standAt("0.5");
        EXPECT_FALSE(wall.named("/crawl")["playing"]);
        EXPECT_EQ(wall.named("/crawl")["time"], 0.5);
        early = wall.settledPicture();
        wall.standAt("1.25");
        late = wall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(early, late), 1000u);
        // On from there, and faster: it comes around, and the crane is stopped by the wall.
        wall.tell({"speed", "/crawl", "7"});
        wall.tell({"speed", "/swing", "20"});
        for (const char* node : {"/crawl", "/swing"}) wall.tell({"play", node});
        for (int i = 0; i < 200 && wall.placeOf("/crane").x() < 2.0; ++i) wall.settle();
        EXPECT_GT(wall.placeOf("/crane").x(), 2.0);
        EXPECT_LT(wall.placeOf("/crane").x(), 2.4 - 0.15 - 0.2);
        EXPECT_FALSE(wall.contacts().empty());
        wall.tell({"undo"});  // of the last play: playing itself is no step
        EXPECT_FALSE(wall.named("/swing")["playing"]);
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    AnimationWall one("1x1");
    one.standAt("1.25");
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), late), 0u);
    one.standAt("0.5");
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), early), 0u);
    const CommandOutcome none = one.ctl({"play", "/floor"});
    EXPECT_NE(none.exitCode, 0);
    EXPECT_WORDS(none.output);
    const CommandOutcome far = one.ctl({"seek", "/crawl", "1e300"});
    EXPECT_EQ(far.exitCode, 0);
    EXPECT_NE(far.output.find("beyond its end"), std::string::npos) << far.output;
    EXPECT_NE(one.ctl({"seek", "/crawl", "nan"}).exitCode, 0);
    (void)one.finish();
}

/// A skinned FBX, read by assimp: the same poses on all tiles, and the first view shows all of them.
TEST(AnimationWall, AnFbxWithBonesIsTheSameOnAllWallsAtEveryTimeThatIsAskedFor) {
    const std::string fbx = "/usr/share/assimp/models/FBX/huesitos.fbx";
    std::vector<Picture> seen;
    for (const char* shape : {"2x2", "1x1"}) {
        AnimationWall wall(shape, fbx);
        const nlohmann::json told = wall.ask({"animations"})["animations"];
        ASSERT_EQ(told.size(), 1u);
        EXPECT_NEAR(told[0]["length"].get<double>(), 39.0 / 25, 1e-9);
        const std::string node = told[0]["node"];
        EXPECT_TRUE(told[0]["playing"]);
        wall.tell({"pause", node});
        std::size_t which = 0;
        for (const char* seconds : {"0", "0.5", "1.2"}) {
            wall.tell({"seek", node, seconds});
            const Picture now = wall.settledPicture();
            if (shape == std::string("2x2")) {
                if (!seen.empty()) EXPECT_GT(pixelsThatDiffer(seen.back(), now), 300u);
                seen.push_back(now);
            } else {
                EXPECT_EQ(pixelsThatDiffer(seen[which++], now), 0u) << seconds << " s";
            }
        }
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
}

}  // namespace
}  // namespace tessera::simulation
