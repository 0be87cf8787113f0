/// What the wall says of a program that does not compile: before the thing, on all tiles alike, until it is right.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

constexpr const char* kPaintShop = R"(
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -40 } } directional_light { intensity: 2 shadows: true } }
material { name: "wrong" program { surface: "void surface(inout Surface s) {\n  s.base = colour;\n}" } }
node { name: "car" transform {} node { name: "body" material: "wrong" box { size { x: 1.2 y: 0.7 z: 0.6 } } } }
node { name: "floor" transform { translation { y: -0.6 } } node { name: "slab" box { size { x: 6 y: 0.1 z: 6 } } } }
node { name: "camera" transform { translation { y: 0.2 z: 4 } } camera { world_units_per_metre: 1 } }
)";
constexpr const char* kWords = "/program-problems/notice/turn/lines/words";
constexpr const char* kRight = "void surface(inout Surface s) { s.base = vec4(0.1, 0.6, 0.2, 1.0); }";

class PaintShop : public AskedWall {
public:
    explicit PaintShop(const std::string& wall, std::vector<std::string> server = {})
        : AskedWall({.wall = wall, .scene = written(), .size = "640x360", .server = std::move(server)}), ready(start()) {}
    /// What the wall says; empty: nothing.
    [[nodiscard]] std::string notice() {
        const Outcome told = wall().ctl({"get", kWords, "text"});
        return told.exitCode == 0 ? told.output : std::string();
    }
    /// Waits until it says something with these words in it, or nothing.
    [[nodiscard]] bool says(const std::string& words) {
        for (int i = 0; i < 100; ++i) {
            const std::string now = notice();
            if (words.empty() ? now.empty() : now.find(words) != std::string::npos) return true;
            settle();
        }
        return false;
    }
    /// As the notice has it: "#12".
    [[nodiscard]] std::string program() {
        const std::string text = notice();
        const std::size_t at = text.find('#');
        return at == std::string::npos ? text : text.substr(at, text.find_first_not_of("0123456789", at + 1) - at);
    }
    const bool ready;

private:
    [[nodiscard]] static std::string written() {
        static const TemporaryFolder folder;
        const std::string path = folder.path() + "/paint-shop.tsct";
        std::ofstream(path) << kPaintShop;
        return path;
    }
};

TEST(ProgramWall, WhatIsWrongStandsBeforeTheThingUntilItIsRight) {
    PaintShop shop("2x2");
    ASSERT_TRUE(shop.ready) << shop.logs();
    ASSERT_TRUE(shop.says("/car/body: SurfaceProgram #")) << shop.logs();
    EXPECT_TRUE(shop.says("surface, line 2:")) << shop.notice();
    EXPECT_TRUE(shop.says("colour")) << shop.notice();
    const Picture wrong = shop.picture("wrong");
    const std::string program = shop.program();
    EXPECT_EQ(shop.ask({"status"})["undo_depth"], 0) << "nobody's step";
    shop.tell({"set", program, "surface", kRight});
    ASSERT_TRUE(shop.says("")) << shop.notice();
    const Picture right = shop.picture("right");
    EXPECT_GT(pixelsThatDiffer(wrong, right), 2000u);
    shop.tell({"undo"});
    ASSERT_TRUE(shop.says("line 2"));
    EXPECT_EQ(pixelsThatDiffer(shop.picture("again"), wrong), 0u);
    // It goes along, and with the thing.
    shop.tell({"move", "/car", "0.5", "0", "0"});
    shop.settle();
    EXPECT_GT(pixelsThatDiffer(shop.picture("moved"), wrong), 1000u);
    shop.tell({"save", shop.folder() + "/saved.tsct"});
    EXPECT_EQ(readText(shop.folder() + "/saved.tsct").find("program-problems"), std::string::npos) << "no file has it";
    shop.tell({"remove", "/car"});
    EXPECT_TRUE(shop.says(""));
    shop.tell({"undo"});
    EXPECT_TRUE(shop.says("line 2"));
    EXPECT_EQ(shop.finish()["replication"]["state_hash_mismatches"], 0);
}

TEST(ProgramWall, WhatIsWrongIsTheSameOnEveryWallAndMayBeLeftOut) {
    Picture wrong;
    {
        PaintShop shop("2x2");
        ASSERT_TRUE(shop.ready) << shop.logs();
        ASSERT_TRUE(shop.says("line 2")) << shop.notice();
        wrong = shop.picture("wrong");
        (void)shop.finish();
    }
    const TemporaryFolder folder;
    PaintShop one("1x1", {"--record", folder.path() + "/shop.tsr"});
    ASSERT_TRUE(one.ready) << one.logs();
    ASSERT_TRUE(one.says("line 2"));
    EXPECT_EQ(pixelsThatDiffer(one.picture("one"), wrong), 0u) << "the seams go through the letters";
    one.tell({"set", one.program(), "surface", kRight});
    EXPECT_TRUE(one.says(""));
    (void)one.finish();
    const Outcome replayed = run(folder.path(), {program("tessera-replay"), folder.path() + "/shop.tsr"});
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
    PaintShop silent("1x1", {"--no-notices"});
    ASSERT_TRUE(silent.ready) << silent.logs();
    silent.settle();
    EXPECT_GT(pixelsThatDiffer(silent.picture("silent"), wrong), 1000u);
    EXPECT_EQ(silent.notice(), "");
    (void)silent.finish();
}

/// As many pixels as its letters have: neither magenta nor black, nor the white of what is lit.
std::size_t pixelsOfLetters(const Picture& picture) {
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
        count += picture.rgb[i] > 240 && picture.rgb[i + 1] > 220 && picture.rgb[i + 1] < 255 && picture.rgb[i + 2] > 150 && picture.rgb[i + 2] < 230;
    return count;
}

/// The car is as large as a house, all of whose walls are wrong, and the wall stands in it.
TEST(ProgramWall, WhoStandsInTheThingReadsItToo) {
    std::vector<Picture> pictures;
    for (const char* wall : {"1x1", "2x2"}) {
        PaintShop shop(wall);
        ASSERT_TRUE(shop.ready) << shop.logs();
        ASSERT_TRUE(shop.says("line 2")) << shop.logs();
        shop.tell({"set", "/car", "scale", "20", "20", "40"});
        shop.settle();
        pictures.push_back(shop.picture("inside"));
        EXPECT_GT(pixelsOfLetters(pictures.back()), 500u);
        shop.tell({"view", "--orientation", "0.5", "0", "0.8660254", "0"});
        shop.settle();
        pictures.push_back(shop.picture("turned"));
        EXPECT_GT(pixelsOfLetters(pictures.back()), 500u) << "wherever one looks";
        EXPECT_EQ(shop.finish()["replication"]["state_hash_mismatches"], 0);
    }
    for (std::size_t i : {0u, 1u}) EXPECT_EQ(pixelsThatDiffer(pictures[i], pictures[i + 2]), 0u) << "the seams go through the letters";
}

TEST(ProgramWall, AServerThatIsKilledSaysItAgain) {
    const TemporaryFolder folder;
    const std::vector<std::string> journal{"--journal", folder.path() + "/journal"};
    Picture wrong;
    std::string words;
    {
        PaintShop shop("1x1", journal);
        ASSERT_TRUE(shop.ready) << shop.logs();
        ASSERT_TRUE(shop.says("line 2"));
        words = shop.notice();
        wrong = shop.picture("wrong");
        shop.wall().server().signal(SIGKILL);
        ASSERT_TRUE(shop.wall().server().waitForExit(std::chrono::seconds(20)));
    }
    PaintShop again("1x1", journal);
    ASSERT_TRUE(again.ready) << again.logs();
    ASSERT_TRUE(again.says("line 2"));
    EXPECT_EQ(again.notice(), words);
    EXPECT_EQ(pixelsThatDiffer(again.picture("again"), wrong), 0u);
    again.tell({"set", again.program(), "surface", kRight});
    EXPECT_TRUE(again.says("")) << again.notice();
    (void)again.finish();
}

}  // namespace
}  // namespace tessera::test
