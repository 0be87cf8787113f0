/// Inlines and ProxyGroups on walls: there with the first frame, near, by hand; the same on all
/// tiles; undone, saved, failed in words.
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

const std::string kVillage = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/village/village.tsct";

class InlineWall : public AskedWall {
public:
    explicit InlineWall(const std::string& wall, const std::string& scene = kVillage,
                        std::vector<std::string> server = {})
        : AskedWall({.wall = wall, .scene = scene, .server = std::move(server)}) {}
    [[nodiscard]] nlohmann::json named(const std::string& node) {
        const nlohmann::json told = ask({"inlines"});
        for (const nlohmann::json& entry : told["inlines"])
            if (entry["node"] == node) return entry;
        return {{"state", "none"}, {"problem", ""}};
    }
    /// Until it is so; the state that it has then.
    [[nodiscard]] std::string waitForState(const std::string& node, const std::string& state) {
        for (int look = 0; look < 400 && named(node)["state"] != state; ++look) settle();
        return named(node)["state"];
    }
    [[nodiscard]] std::size_t found(const std::string& expression) { return ask({"find", expression})["nodes"].size(); }
};

TEST(InlineWall, HousesComeAtOnceNearAndByHandAndTwoByTwoShowsWhatOneByOneShows) {
    Picture boxes, all;
    {
        InlineWall wall("2x2");
        EXPECT_EQ(wall.named("/house/inline")["state"], "there") << "with the first frame";
        EXPECT_EQ(wall.named("/mill/proxy_group")["state"], "waiting");
        EXPECT_EQ(wall.named("/church/proxy_group")["state"], "waiting");
        boxes = wall.settledPicture();
        const std::string undoable = wall.ask({"status"})["undo_depth"].dump();
        // Somebody goes to the mill, whose sails are another file.
        wall.tell({"view", "--position", "3", "0", "-1"});
        EXPECT_EQ(wall.waitForState("/mill/proxy_group", "there"), "there");
        EXPECT_EQ(wall.waitForState("/mill/proxy_group/hub/inline", "there"), "there");
        EXPECT_EQ(wall.found("/mill/**/sails"), 1u);
        EXPECT_EQ(wall.ask({"status"})["undo_depth"].dump(), undoable) << "what comes so is nobody's step";
        wall.tell({"set", "/church/proxy_group", "wanted", "true"});
        EXPECT_EQ(wall.waitForState("/church/proxy_group", "there"), "there");
        wall.tell({"view", "--reset"});
        all = wall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(boxes, all), 1000u);
        // Back, and again: what is wanted is what is there.
        wall.tell({"undo"});
        EXPECT_EQ(wall.named("/church/proxy_group")["state"], "waiting");
        EXPECT_EQ(wall.found("/church/**/spire"), 0u);
        wall.tell({"redo"});
        EXPECT_EQ(wall.waitForState("/church/proxy_group", "there"), "there");
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), all), 0u);
        EXPECT_EQ(wall.ctl({"set", "/church/proxy_group", "state", "waiting"}).exitCode, 1);
        // What cannot be read is said where it is; the rest goes on.
        wall.tell({"set", "/house/inline", "file", "/none/such.tsct"});
        EXPECT_EQ(wall.waitForState("/house/inline", "failed"), "failed");
        EXPECT_NE(wall.named("/house/inline")["problem"].get<std::string>().find("/none/such.tsct"), std::string::npos);
        EXPECT_EQ(wall.found("/house/**/door"), 0u);
        wall.tell({"undo"});
        EXPECT_EQ(wall.waitForState("/house/inline", "there"), "there");
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), all), 0u);
        const std::string saved = wall.folder() + "/saved.tsct";
        wall.tell({"save", saved});
        (void)wall.finish();
        // What was there is saved as it is, and not loaded once more.
        InlineWall again("1x1", saved);
        EXPECT_EQ(again.named("/house/inline")["state"], "there");
        EXPECT_EQ(again.found("/house/**/door"), 1u);
        EXPECT_EQ(pixelsThatDiffer(again.settledPicture(), all), 0u);
        (void)again.finish();
    }
    InlineWall one("1x1");
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), boxes), 0u);
    for (const char* node : {"/mill/proxy_group", "/church/proxy_group"}) one.tell({"set", node, "wanted", "true"});
    EXPECT_EQ(one.waitForState("/church/proxy_group", "there"), "there");
    EXPECT_EQ(one.waitForState("/mill/proxy_group/hub/inline", "there"), "there");
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), all), 0u);
    const nlohmann::json report = one.finish();
    EXPECT_FALSE(report["scene"].contains("promised"));
}

}  // namespace
}  // namespace tessera::simulation
