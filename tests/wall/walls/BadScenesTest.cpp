/// Scenes that make no sense: tessera-check and tessera-server refuse the same ones, with the same words, at the same
/// place.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include "server/tools/CheckCommand.h"
#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

struct BadScene {
    const char* name;
    const char* text;
    const char* at;  ///< line:column
};

const char* const kTree =
    "node { name: \"bare\" }\nnode { name: \"box\" box { size { x: 1 y: 1 z: 1 } } }\n"
    "node { name: \"crane\" transform {} box { size { x: 1 y: 1 z: 1 } } }\n";
const char* const kSaved =
    "saved { root: 1 object { number: 1 child: 2 node {} }\n object { number: 2 node { core: 3 } } object { number: 3 "
    "group {} }\n";

/// A text after kTree stands in line 4, one after kSaved in line 3.
const BadScene kBadScenes[] = {
    {"manipulator of nobody", "node { manipulator { target: \"/nobody\" } }", "4:1"},
    {"manipulator of nothing", "node { manipulator {} }", "4:1"},
    {"manipulator of a bare node", "node { manipulator { target: \"/bare\" } }", "4:1"},
    {"manipulator of a surface", "node { manipulator { target: \"/box\" } }", "4:1"},
    {"a centre ball without a centre", "node { manipulator { target: \"/crane\" kind: CENTERBALL } }", "4:1"},
    {"a lamp's handle at a crane", "node { manipulator { target: \"/crane\" kind: POINT_LIGHT } }", "4:1"},
    {"a motion without keys", "node { transform {} motion {} }", "4:1"},
    {"a motion of nobody", "node { motion { target: \"/nobody\" key { time: 0 } key { time: 1 } } }", "4:8"},
    {"a motion that goes back in time", "node { transform {} motion { key { time: 1 } key { time: 0 } } }", "4:1"},
    {"an animation of nobody",
     "node { animation { channel { target: \"/nobody\" field: \"scale\" time: 0 value: 1 } } }", "4:8"},
    {"an animation of no field",
     "node { animation { channel { target: \"/crane\" field: \"weight\" time: 0 value: 1 } } }", "4:8"},
    {"keys that go back in time",
     "node { animation { channel { target: \"/crane\" field: \"translation\" time: [1, 0] value: [0,0,0,0,0,0] } } }",
     "4:8"},
    {"keys of too few numbers",
     "node { animation { channel { target: \"/crane\" field: \"translation\" time: [0, 1] value: [0,0,0] } } }", "4:8"},
    {"ranges that fall", "node { distance_lod { range: [5, 1] } }", "4:1"},
    {"an interest in nobody", "node { interest { object: \"/nobody\" } }", "4:8"},
    {"a light at nobody's place", "node { point_light { beacon: \"/nobody\" } }", "4:1"},
    {"an instance of nothing", "node { instance: \"crane\" }", "4:1"},
    {"a scene in itself", "node { import { uri: \"scene.tsct\" } }", "4:8"},
    {"a material of no name", "node { box { size { x: 1 y: 1 z: 1 } } material: \"wood\" }", "4:40"},
    {"five passes",
     "material { name: \"a\" }\nmaterial { name: \"b\" pass: [\"a\", \"a\", \"a\", \"a\", \"a\"] }\nnode { box { size "
     "{ x: 1 y: 1 z: 1 } } material: \"b\" }",
     "6:1"},
    {"two films on one screen",
     "image { name: \"i\" }\nnode { movie { image: \"i\" file: \"a.avi\" } }\nnode { movie { image: \"i\" file: "
     "\"b.avi\" } }",
     "6:1"},
    {"no number", "node { transform { translation { x: nan } } box { size { x: 1 y: 1 z: 1 } } }", "4:1"},
    {"a camera of no place",
     "node { transform { translation { x: 9e14 } } node { transform { translation { x: 9e14 } } node { camera {} } } }",
     "4:91"},
    {"a camera of an ant", "node { camera { world_units_per_metre: 1e10 } }", "4:1"},
    {"saved: manipulator of a group", "object { number: 4 manipulator { target: 2 } } }", "3:1"},
    {"saved: keys of no field",
     "object { number: 4 key_frames { target: 2 field: \"weight\" times: 1 values: 1 } } } blob: \"12345678\"", "3:1"},
    {"saved: an image without bytes",
     "object { number: 4 image { pixels: 1 width_px: 3 height_px: 3 } } } blob: \"abcd\"", "3:1"},
    {"saved: five passes",
     "object { number: 4 material { passes: [5, 6, 7, 8, 9] } }\nobject { number: 5 material {} } object { number: 6 "
     "material {} } "
     "object { number: 7 material {} } object { number: 8 material {} } object { number: 9 material {} } }",
     "3:1"},
    {"saved: two films on one screen",
     "object { number: 4 movie { image: 5 } }\nobject { number: 5 image {} }\nobject { number: 6 movie { image: 5 } } "
     "}",
     "5:1"},
    {"saved: a camera of an ant", "object { number: 4 camera { world_units_per_metre: 1e10 } } }", "3:1"},
};

CommandOutcome check(std::vector<std::string> words) {
    return runHere([&] { return runCheck(words); });
}

/// A server that starts with this scene, until it shows it or ends.
class StartedServer {
public:
    explicit StartedServer(const std::string& scene, std::vector<std::string> words = {})
        : wall_({.scene = scene, .wall = "1x1", .hosts = false, .server = std::move(words)}) {
        (void)wall_.world().runUntil([&] { return !wall_.serverLives() || shows(); }, 60s);
    }
    [[nodiscard]] bool shows() const { return wall_.logs().find("scene: ") != std::string::npos; }
    /// Why it has ended; empty: it has not.
    [[nodiscard]] const std::string& error() const { return wall_.serverError(); }
    [[nodiscard]] std::string logs() const { return wall_.logs(); }

private:
    SimulatedWall wall_;
};

TEST(BadScenes, CheckAndServerRefuseTheSameInTheSameWordsAtTheSamePlace) {
    const test::TestFolder folder;
    for (const BadScene& bad : kBadScenes) {
        SCOPED_TRACE(bad.name);
        const bool saved = std::string_view(bad.text).starts_with("object");
        const std::string path = folder.write("scene.tsct", std::string(saved ? kSaved : kTree) + bad.text + "\n");
        const CommandOutcome checked = check({path});
        EXPECT_EQ(checked.exitCode, 3) << checked.output;
        EXPECT_TRUE(checked.output.starts_with(path + ":" + bad.at + ": ")) << checked.output;
        EXPECT_WORDS(checked.output);
        const StartedServer server(path);
        EXPECT_EQ(server.error() + "\n", checked.output) << server.logs();
    }
}

TEST(BadScenes, AHandleAtWhatMovesByItselfIsSaidByBothAndStarts) {
    const test::TestFolder folder;
    for (const auto& [mover, by] :
         {std::pair("motion { target: \"/crane\" key { time: 0 } key { time: 1 } }", "a motion"),
          {"animation { channel { target: \"/crane\" field: \"translation\" time: [0, 1] value: [0, 0, 0, 1, 0, 0] } }",
           "an animation"}}) {
        const std::string path =
            folder.write("driven.tsct",
                         std::string(kTree) + "node { manipulator { target: \"/crane\" } }\nnode { " + mover + " }\n");
        const std::string note = path + ":4:1: what this manipulator moves is driven by " + by;
        const CommandOutcome checked = check({path});
        EXPECT_EQ(checked.exitCode, 0) << checked.output;
        EXPECT_NE(checked.output.find(note), std::string::npos) << checked.output;
        const StartedServer server(path);
        EXPECT_NE(server.logs().find(note), std::string::npos) << server.logs();
        EXPECT_TRUE(server.shows()) << server.logs();
    }
}

/// The words and numbers of a text: where each stands, and how long it is.
std::vector<std::pair<std::size_t, std::size_t>> piecesOf(const std::string& text) {
    std::vector<std::pair<std::size_t, std::size_t>> pieces;
    for (std::size_t at = 0; at < text.size();) {
        std::size_t end = at;
        while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 ||
                                     std::string_view("_.-").find(text[end]) != std::string_view::npos))
            ++end;
        if (end > at) pieces.emplace_back(at, end - at);
        at = end + 1;
    }
    return pieces;
}

/// One or two words or numbers become others of the same text, or numbers that few fields hold.
std::string changedSomewhere(std::string text, std::mt19937& random) {
    for (unsigned change = 0; change < 1 + random() % 2; ++change) {
        const auto pieces = piecesOf(text);
        const auto [at, length] = pieces[random() % pieces.size()];
        const auto [other, otherLength] = pieces[random() % pieces.size()];
        const char* const numbers[] = {"0", "-1", "7", "1e30", "nan", "1e10"};
        const bool isNumber = std::isdigit(static_cast<unsigned char>(text[at + length - 1])) != 0;
        text.replace(at, length,
                     isNumber ? std::string(numbers[random() % std::size(numbers)]) : text.substr(other, otherLength));
    }
    return text;
}

TEST(BadScenes, OfShippedScenesThatAreChangedAtRandomBothRefuseTheSame) {
    namespace fs = std::filesystem;
    const test::TestFolder folder;
    const std::string scenes = folder.path() + "/scenes";
    fs::copy(TESSERA_SOURCE_DIR "/deploy/scenes", scenes, fs::copy_options::recursive);
    std::vector<std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(scenes))
        if (entry.path().extension() == ".tsct" && entry.file_size() < 12'000) files.push_back(entry.path().string());
    std::ranges::sort(files);
    ASSERT_GT(files.size(), 20u);
    const char* const only = std::getenv("TESSERA_SEED");
    const unsigned first = only ? static_cast<unsigned>(std::stoul(only)) : 1;
    std::size_t refused = 0;
    for (unsigned seed = first; seed < first + (only ? 1 : 60); ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/wall --gtest_filter=BadScenes.OfShipped*", seed));
        std::mt19937 random(seed);
        const std::string& file = files[random() % files.size()];
        const std::string path = fs::path(file).parent_path().string() + "/changed.tsct";
        std::ofstream(path) << changedSomewhere(readText(file), random);
        const std::vector<std::string> assets = {"--assets", "/usr/share/assimp/models"};
        const CommandOutcome checked = check({path, assets[0], assets[1]});
        const StartedServer server(path, assets);
        const bool shown = server.shows();
        // A picture that is not there is wrong, as is a material's number out of its bounds, and the rest is shown.
        const bool lost = checked.output.find(" cannot be had: ") != std::string::npos ||
                          checked.output.find(" is taken\n") != std::string::npos;
        EXPECT_EQ(shown, checked.exitCode == 0 || lost) << "check: " << checked.output << "server: " << server.logs();
        if (shown) continue;
        ++refused;
        std::string last = checked.output.substr(0, checked.output.size() - 1);
        last = last.substr(last.rfind('\n') + 1);
        EXPECT_NE(server.error().find(last), std::string::npos)
            << "check: " << checked.output << "server: " << server.error() << server.logs();
        fs::remove(path);
    }
    EXPECT_TRUE(only || refused > 20) << refused;
}

}  // namespace
}  // namespace tessera::simulation
