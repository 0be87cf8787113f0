/// What the wall says of a program that does not compile: before the thing, on all tiles alike, until it is right.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

constexpr const char* kPaintShop = R"(
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -40 } }
  directional_light { intensity: 2 shadows: true } }
material { name: "wrong" program { surface: "void surface(inout Surface s) {\n  s.base = colour;\n}" } }
node { name: "car" transform {} node { name: "body" material: "wrong" box { size { x: 1.2 y: 0.7 z: 0.6 } } } }
node { name: "floor" transform { translation { y: -0.6 } } node { name: "slab" box { size { x: 6 y: 0.1 z: 6 } } } }
node { name: "camera" transform { translation { y: 0.2 z: 4 } } camera { world_units_per_metre: 1 } }
)";
constexpr const char* kWords = "/program-problems/notice/turn/lines/words";
constexpr const char* kRight = "void surface(inout Surface s) { s.base = vec4(0.1, 0.6, 0.2, 1.0); }";

class PaintShop : public AskedWall {
public:
    explicit PaintShop(const std::string& wall, std::vector<std::string> server = {},
                       const std::string& scene = kPaintShop)
        : AskedWall(
              {.wall = wall, .scene = written(scene), .widthPx = 640, .heightPx = 360, .server = std::move(server)}) {}
    /// What the wall says; empty: nothing.
    [[nodiscard]] std::string notice() {
        const CommandOutcome told = ctl({"get", kWords, "text"});
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
    /// The first object that a field refers to: "#12".
    [[nodiscard]] std::string reference(const std::string& node, const std::string& field) {
        const std::string told = ctl({"get", node, field}).output;
        const std::size_t at = told.find('#');
        return at == std::string::npos ? told : told.substr(at, told.find_first_not_of("0123456789", at + 1) - at);
    }
    /// Waits until status says something of programs with these words in it, or nothing.
    [[nodiscard]] bool tellsOf(const std::string& words) {
        for (int i = 0; i < 100; ++i) {
            const std::string now = ask({"status"})["programs"].dump();
            if (words.empty() ? now == "[]" : now.find(words) != std::string::npos) return true;
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

private:
    [[nodiscard]] static std::string written(const std::string& scene) {
        static const test::TestFolder folder;
        // The same name for the same scene: a journal wants that.
        const std::string path = folder.path() + "/shop-" + std::to_string(std::hash<std::string>()(scene)) + ".tsct";
        std::ofstream(path) << scene;
        std::ofstream faces(folder.path() + "/faces.ppm");
        faces << "P3 2 12 255\n";
        for (int i = 0; i < 24; ++i) faces << 40 * (i / 4) << " " << 255 - 40 * (i / 4) << " " << 60 * (i % 4) << "\n";
        return path;
    }
};

TEST(ProgramWall, WhatIsWrongStandsBeforeTheThingUntilItIsRight) {
    PaintShop shop("2x2");
    ASSERT_TRUE(shop.says("/car/body: SurfaceProgram #")) << shop.logs();
    EXPECT_TRUE(shop.says("surface, line 2:")) << shop.notice();
    EXPECT_TRUE(shop.says("colour")) << shop.notice();
    const Picture wrong = shop.settledPicture();
    const std::string program = shop.program();
    EXPECT_EQ(shop.ask({"status"})["undo_depth"], 0) << "nobody's step";
    shop.tell({"set", program, "surface", kRight});
    ASSERT_TRUE(shop.says("")) << shop.notice();
    const Picture right = shop.settledPicture();
    EXPECT_GT(pixelsThatDiffer(wrong, right), 2000u);
    shop.tell({"undo"});
    ASSERT_TRUE(shop.says("line 2"));
    EXPECT_EQ(pixelsThatDiffer(shop.settledPicture(), wrong), 0u);
    // It goes along, and with the thing.
    shop.tell({"move", "/car", "0.5", "0", "0"});
    shop.settle();
    EXPECT_GT(pixelsThatDiffer(shop.settledPicture(), wrong), 1000u);
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
        ASSERT_TRUE(shop.says("line 2")) << shop.notice();
        wrong = shop.settledPicture();
        (void)shop.finish();
    }
    const test::TestFolder folder;
    PaintShop one("1x1", {"--record", folder.path() + "/shop.tsr"});
    ASSERT_TRUE(one.says("line 2"));
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), wrong), 0u) << "the seams go through the letters";
    one.tell({"set", one.program(), "surface", kRight});
    EXPECT_TRUE(one.says(""));
    (void)one.finish();
    const CommandOutcome replayed = runHere([&] { return runReplay({folder / "shop.tsr"}); });
    EXPECT_EQ(replayed.exitCode, 0) << replayed.output;
    PaintShop silent("1x1", {"--no-notices"});
    silent.settle();
    EXPECT_GT(pixelsThatDiffer(silent.settledPicture(), wrong), 1000u);
    EXPECT_EQ(silent.notice(), "");
    (void)silent.finish();
}

/// As many pixels as its letters have: neither magenta nor black, nor the white of what is lit.
std::size_t pixelsOfLetters(const Picture& picture) {
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
        count += picture.rgb[i] > 240 && picture.rgb[i + 1] > 220 && picture.rgb[i + 1] < 255 &&
                 picture.rgb[i + 2] > 150 && picture.rgb[i + 2] < 230;
    return count;
}

/// The car is as large as a house, all of whose walls are wrong, and the wall stands in it.
TEST(ProgramWall, WhoStandsInTheThingReadsItToo) {
    std::vector<Picture> pictures;
    for (const char* wall : {"1x1", "2x2"}) {
        PaintShop shop(wall);
        ASSERT_TRUE(shop.says("line 2")) << shop.logs();
        shop.tell({"set", "/car", "scale", "20", "20", "40"});
        shop.settle();
        pictures.push_back(shop.settledPicture());
        EXPECT_GT(pixelsOfLetters(pictures.back()), 500u);
        shop.tell({"view", "--orientation", "0.5", "0", "0.8660254", "0"});
        shop.settle();
        pictures.push_back(shop.settledPicture());
        EXPECT_GT(pixelsOfLetters(pictures.back()), 500u) << "wherever one looks";
        EXPECT_EQ(shop.finish()["replication"]["state_hash_mismatches"], 0);
    }
    for (std::size_t i : {0u, 1u})
        EXPECT_EQ(pixelsThatDiffer(pictures[i], pictures[i + 2]), 0u) << "the seams go through the letters";
}

/// Nothing but arithmetic: none of it at 0 and 1, at 2 many times what hosts wait for a tile. It is harmless in the
/// trial, far from whose limit it stays on a busy machine, too. A round is dear and
/// the car is near, because loops end after 1024 rounds; and no dearer, because the trial has 2 s to compile it.
std::string dearShop() {
    std::string body;
    for (int i = 0; i < 8; ++i)
        body += "    \"n = fract(sin(n * 12.9 + " + std::to_string(i) +
                ".5) * 43758.5 + pow(abs(cos(n)), 1.7) + exp(-n) + log(2.0 + n * n) + atan(n, 2.0));\\n\"\n";
    return R"(
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -40 } } directional_light { intensity: 2 } }
material { name: "paint" base_color { r: 0.1 g: 0.6 b: 0.2 }
  program { surface: "uniform float rounds;\n"
    "void surface(inout Surface s) { float n = uv.x;\n"
    "for (int i = 0; i < 1024 && float(i) < (rounds - 1.0) * 1024.0; ++i) {\n"
)" + body + R"(    "} s.base.rgb = vec3(0.7 + 1e-4 * n, 0.1, 0.1); }" }
  uniform { name: "rounds" value: [1] } }
node { name: "car" transform {} node { name: "body" material: "paint" box { size { x: 3 y: 1.6 z: 0.6 } } } }
node { name: "camera" transform { translation { y: 0.2 z: 3 } } camera { world_units_per_metre: 1 } }
)";
}

TEST(ProgramWall, WhatHoldsHostsUpIsDrawnPlainAndSaidAndTheWallGoesOn) {
    PaintShop shop("2x2", {}, dearShop());
    const std::string material = shop.reference("/car/body", "material"), program = shop.reference(material, "program"),
                      uniform = shop.reference(material, "uniforms");
    const auto verdict = [&] { return shop.ctl({"get", program, "verdict"}).output; };
    for (int i = 0; i < 100 && verdict() == "untried\n"; ++i) shop.settle();
    ASSERT_EQ(verdict(), "good\n");
    shop.settle();
    EXPECT_TRUE(shop.tellsOf(""));
    const Picture cheap = shop.settledPicture();
    shop.tell({"set", uniform, "value", "2", "0", "0", "0"});
    ASSERT_TRUE(shop.says("it held up host")) << shop.logs();
    EXPECT_TRUE(shop.tellsOf("is heavy"));
    EXPECT_EQ(verdict(), "heavy\n");
    // The wall goes on: it is asked for something, and shows it.
    const Picture heavy = shop.settledPicture();
    shop.tell({"move", "/car", "0.2", "0", "0"});
    shop.settle();
    EXPECT_GT(pixelsThatDiffer(shop.settledPicture(), heavy), 500u);
    shop.tell({"undo"});
    shop.settle();
    // As the material without a program, behind the same words.
    std::size_t green = 0, red = 0;
    for (std::size_t i = 0; i + 2 < heavy.rgb.size(); i += 3) {
        green += heavy.rgb[i + 1] > 40 + heavy.rgb[i];
        red += heavy.rgb[i] > 40 + heavy.rgb[i + 1];
    }
    EXPECT_GT(green, 2000u);
    EXPECT_EQ(red, 0u) << "what the program makes of it";
    // Harmless again: it stays as it is, as an animation may say 2 in the next frame; until its text is said again.
    shop.tell({"set", uniform, "value", "1", "0", "0", "0"});
    shop.settle();
    EXPECT_NE(shop.notice(), "");
    std::string text = shop.ctl({"get", program, "surface"}).output;
    text.pop_back();
    shop.tell({"set", program, "surface", text});
    ASSERT_TRUE(shop.says("")) << shop.notice();
    EXPECT_TRUE(shop.tellsOf(""));
    EXPECT_EQ(pixelsThatDiffer(shop.settledPicture(), cheap), 0u);
    EXPECT_EQ(shop.finish()["replication"]["state_hash_mismatches"], 0);
}

constexpr const char* kCubeShop = R"(
node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -40 } } directional_light { intensity: 2 } }
image { name: "sky" uri: "faces.ppm" shape: CUBE }
image { name: "flat" uri: "faces.ppm" }
material { name: "wrong" base_color { r: 0.1 g: 0.6 b: 0.2 }
  program { surface: "uniform sampler2D map; void surface(inout Surface s) { s.base.rgb = texture(map, uv).rgb; }" }
  uniform { name: "map" image: "sky" } }
material { name: "right"
  program { surface: "uniform sampler2D map; void surface(inout Surface s) { s.base.rgb = texture(map, uv).rgb; }" }
  uniform { name: "map" image: "flat" } }
node { name: "car" transform {} node { name: "body" material: "wrong" box { size { x: 1.2 y: 0.7 z: 0.6 } } } }
node { name: "floor" transform { translation { y: -0.6 } }
  node { name: "slab" material: "right" box { size { x: 6 y: 0.1 z: 6 } } } }
node { name: "camera" transform { translation { y: 0.2 z: 4 } } camera { world_units_per_metre: 1 } }
)";

TEST(ProgramWall, ACubeInASamplerOfFlatImagesIsSaidAndHasNoSeams) {
    std::vector<Picture> pictures;
    for (const char* wall : {"1x1", "2x2"}) {
        PaintShop shop(wall, {}, kCubeShop);
        ASSERT_TRUE(shop.says("is a cube")) << shop.logs();
        EXPECT_WORDS(shop.notice());
        pictures.push_back(shop.settledPicture());
        const std::string uniform = shop.reference(shop.reference("/car/body", "material"), "uniforms");
        shop.tell({"set", uniform, "image",
                   shop.reference(shop.reference(shop.reference("/floor/slab", "material"), "uniforms"), "image")});
        EXPECT_TRUE(shop.says("")) << shop.notice();
        EXPECT_GT(pixelsThatDiffer(shop.settledPicture(), pictures.back()), 1000u);
        (void)shop.finish();
    }
    EXPECT_EQ(pixelsThatDiffer(pictures[0], pictures[1]), 0u);
}

TEST(ProgramWall, AServerThatIsKilledSaysItAgain) {
    const test::TestFolder folder;
    const std::vector<std::string> journal{"--journal", folder.path() + "/journal"};
    Picture wrong;
    std::string words;
    {
        PaintShop shop("1x1", journal);
        ASSERT_TRUE(shop.says("line 2"));
        words = shop.notice();
        wrong = shop.settledPicture();
        shop.killServer();
    }
    PaintShop again("1x1", journal);
    ASSERT_TRUE(again.says("line 2"));
    EXPECT_EQ(again.notice(), words);
    EXPECT_EQ(pixelsThatDiffer(again.settledPicture(), wrong), 0u);
    again.tell({"set", again.program(), "surface", kRight});
    EXPECT_TRUE(again.says("")) << again.notice();
    (void)again.finish();
}

}  // namespace
}  // namespace tessera::simulation
