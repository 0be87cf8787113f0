#include "common/codec/WallCodec.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "common/base/ShippedFiles.h"
#include "common/wall/View.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

const char* const kExample = R"(screens { name: "front"
  lower_left { x: -1.6 y: 0.6 z: 0 } lower_right { x: 1.6 y: 0.6 z: 0 } upper_left { x: -1.6 y: 2.4 z: 0 }   # metres
  grid { columns: 2 rows: 1 tile_width_px: 960 tile_height_px: 540 } }
users { name: "viewer" position { x: 0 y: 1.7 z: 2.4 } eye_separation_m: 0.065 }
hosts { name: "left" tiles { screen: "front" column: 0 row: 0 eye: CENTER user: "viewer" } }
hosts { name: "right"
  tiles { screen: "front" column: 1 row: 0 eye: CENTER user: "viewer" } }
sync  { late_frame: WAIT frame_deadline_ms: 10000 heartbeat_ms: 100 lost_after_ms: 800 }
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

std::string errorOf(const std::string& text) {
    const Expected<Wall> wall = parseWall(text, "some/try.wall");
    return wall ? "accepted" : wall.error().message;
}

/// The example with one thing changed, and what is then said.
std::string errorAfter(const std::string& from, const std::string& to) {
    return errorOf(replaced(kExample, from, to));
}

#define EXPECT_BEGINS(text, start) EXPECT_EQ(std::string(text).substr(0, std::string(start).size()), start)

/// At this place of some/try.wall, "2:38".
void expectWordsAt(const std::string& place, const std::string& error) {
    EXPECT_BEGINS(error, "some/try.wall:" + place + ": ");
    EXPECT_WORDS(error);
}

TEST(WallText, ReadsTheDocumentedExample) {
    const Expected<Wall> wall = parseWall(kExample, "some/try.wall");
    ASSERT_TRUE(wall) << wall.error().message;
    EXPECT_EQ(wall->name, "try");
    ASSERT_EQ(wall->screens.size(), 1u);
    EXPECT_EQ(wall->screens[0].upperLeft, Vec3d(-1.6, 2.4, 0));
    EXPECT_EQ(wall->screens[0].grid.columns, 2);
    EXPECT_EQ(wall->screens[0].grid.tileHeightPx, 540);
    EXPECT_EQ(wall->users[0].position, Vec3d(0, 1.7, 2.4));
    ASSERT_EQ(wall->hosts.size(), 2u);
    EXPECT_EQ(wall->hosts[1].tiles[0].column, 1);
    EXPECT_EQ(wall->sync, SyncPolicy());
    EXPECT_EQ(wall->samples, 4);
    EXPECT_EQ(wall->culler, CullerKind::kAuto);
}

constexpr const char* kWithMachine =
    "hosts { name: \"left\" machine { ssh: \"me@wall-3\" port: 2222 command: \"/opt/t/client\" display: \":0\" "
    "environment { name: \"A\" value: \"b c\" } args: \"--window\" args: \"DP-1\" }";

TEST(WallText, ReadsTheMachineOfAHostAndSaysItOnTheWireToo) {
    const Expected<Wall> wall = parseWall(replaced(kExample, "hosts { name: \"left\"", kWithMachine), "f");
    ASSERT_TRUE(wall) << wall.error().message;
    const Machine expected{.ssh = "me@wall-3",
                           .port = 2222,
                           .command = "/opt/t/client",
                           .display = ":0",
                           .environment = {{"A", "b c"}},
                           .arguments = {"--window", "DP-1"}};
    EXPECT_EQ(wall->hosts[0].machine, expected);
    EXPECT_FALSE(wall->hosts[1].machine);
    const Expected<Wall> again = decodeWall(encodeWall(*wall));
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->hosts[0].machine, expected);
    EXPECT_FALSE(again->hosts[1].machine);
    const Expected<Wall> least = parseWall(
        replaced(kExample, "hosts { name: \"left\"", "hosts { name: \"left\" machine { ssh: \"wall-3\" }"), "f");
    ASSERT_TRUE(least);
    EXPECT_EQ(least->hosts[0].machine, Machine{.ssh = "wall-3"});
}

TEST(WallText, RefusesMachinesThatCouldMeanSomethingElseToAShell) {
    const auto with = [](const std::string& inside) {
        return errorAfter("hosts { name: \"left\"", "hosts { name: \"left\" machine { " + inside + " }");
    };
    EXPECT_BEGINS(with(""), "some/try.wall:");
    EXPECT_WORDS(with(""));
    for (const char* ssh :
         {"-oProxyCommand=x", "me@-oProxyCommand=x", "a b", "a;b", "a\\nb", "a$b", "`a`", "a'b", "@wall", "me@", "a|b"})
        EXPECT_WORDS(with(std::string("ssh: \"") + ssh + "\""));
    for (const char* ssh :
         {"wall-3", "me@wall-3.lab.example", "me@10.0.0.3", "me@fe80::1%eth0", "user.name@wall_3", "mein-wand-ä"})
        EXPECT_EQ(with(std::string("ssh: \"") + ssh + "\""), "accepted") << ssh;
    EXPECT_WORDS(with("ssh: \"a\" port: 65536"));
    EXPECT_WORDS(with("ssh: \"a\" port: -1"));
    EXPECT_WORDS(with("ssh: \"a\" command: \"-c\""));
    EXPECT_WORDS(with("ssh: \"a\" command: \"x\\ny\""));
    EXPECT_WORDS(with("ssh: \"a\" display: \":0\\n\""));
    EXPECT_WORDS(with("ssh: \"a\" args: \"a\\001\""));
    EXPECT_WORDS(with("ssh: \"a\" args: \"--host=b\""));
    EXPECT_WORDS(with("ssh: \"a\" args: \"" + std::string(5000, 'x') + "\""));
    EXPECT_WORDS(with("ssh: \"a\" environment { name: \"A B\" }"));
    EXPECT_WORDS(with("ssh: \"a\" environment { name: \"1A\" }"));
    EXPECT_WORDS(with("ssh: \"a\" environment { name: \"A\" value: \"x\\ny\" }"));
    std::string many = "ssh: \"a\"";
    for (int i = 0; i < 65; ++i) many += " args: \"x\"";
    EXPECT_WORDS(with(many));
    EXPECT_WORDS(with("shh: \"a\""));
}

TEST(WallText, ReadsWhatTheExampleLeavesOut) {
    std::string text =
        replaced(kExample, "late_frame: WAIT", "late_frame: HOLD late_after_ms: 40 start_deadline_ms: 900");
    text = replaced(text, "eye_separation_m: 0.065", "eye_separation_m: 0.07 orientation { w: 0.7 y: 0.7 }");
    text = replaced(text, "tile_width_px: 960", "column_widths_px: [900, 901] bezel_x_px: 3");
    const Expected<Wall> wall = parseWall("name: \"lab\" samples: 1 culler: \"masked\"\n" + text, "f");
    ASSERT_TRUE(wall) << wall.error().message;
    EXPECT_EQ(wall->name, "lab");
    EXPECT_EQ(wall->samples, 1);
    EXPECT_EQ(wall->culler, CullerKind::kMasked);
    const Expected<Wall> wrong = parseWall("culler: \"magic\"\n" + text, "f");
    ASSERT_FALSE(wrong);
    EXPECT_WORDS(wrong.error().message);
    EXPECT_EQ(wall->sync.lateFrame, LateFramePolicy::kHold);
    EXPECT_EQ(wall->sync.lateAfter.count(), 40);
    EXPECT_EQ(wall->sync.startDeadline.count(), 900);
    EXPECT_EQ(wall->users[0].eyeSeparationMetres, 0.07);
    EXPECT_EQ(wall->users[0].orientation.y(), 0.7);
    EXPECT_EQ(screenPixels(wall->screens[0]).width, 1804);
}

TEST(WallText, TakesAnyThreeCornersAndFourThatClose) {
    const std::string ll = "lower_left { x: -1.6 y: 0.6 z: 0 }", lr = "lower_right { x: 1.6 y: 0.6 z: 0 }";
    const std::string ul = "upper_left { x: -1.6 y: 2.4 z: 0 }", ur = "upper_right { x: 1.6 y: 2.4 z: 0 }";
    const std::string all = ll + " " + lr + " " + ul;
    const Screen expected = parseWall(kExample, "f")->screens[0];
    for (const std::string& corners : {lr + ul + ur, ll + ul + ur, ll + lr + ur, ll + lr + ul + ur}) {
        const Expected<Wall> wall = parseWall(replaced(kExample, all, corners), "f");
        ASSERT_TRUE(wall) << wall.error().message;
        EXPECT_LT((wall->screens[0].lowerLeft - expected.lowerLeft).norm(), 1e-12);
        EXPECT_LT((wall->screens[0].lowerRight - expected.lowerRight).norm(), 1e-12);
        EXPECT_LT((wall->screens[0].upperLeft - expected.upperLeft).norm(), 1e-12);
    }
    EXPECT_WORDS(errorAfter(all, ll + ur));
    EXPECT_WORDS(errorAfter(all, all + " upper_right { x: 1.6 y: 2.5 z: 0 }"));
}

TEST(WallText, MayBeginWithAByteOrderMark) {
    const std::string text =
        "screens { name: \"s\" lower_left { } lower_right { x: 1 } upper_left { y: 1 } grid { columns: 1 rows: 1 "
        "tile_width_px: 8 tile_height_px: 8 } } "
        "users { name: \"u\" position { z: 2 } } hosts { name: \"h\" tiles { screen: \"s\" user: \"u\" } }";
    const Expected<Wall> plainText = parseWall(text, "x.wall"), marked = parseWall("\xEF\xBB\xBF" + text, "x.wall");
    ASSERT_TRUE(plainText) << plainText.error().message;
    ASSERT_TRUE(marked) << marked.error().message;
    EXPECT_EQ(encodeWall(*marked), encodeWall(*plainText));
}

TEST(WallText, NamesTheNearestKeyAndItsPlace) {
    expectWordsAt("2:38", errorAfter("lower_right", "lower_rigth"));
    expectWordsAt("5:1", errorAfter("hosts { name: \"left\"", "host { name: \"left\""));
    expectWordsAt("3:10", errorAfter("columns: 2", "colums: 2"));
    expectWordsAt("8:51", errorAfter("heartbeat_ms", "hartbeat_ms"));
    EXPECT_WORDS(errorAfter("columns: 2", "zzzzqqqq: 2"));
}

TEST(WallText, NamesTheBraceThatNobodyClosed) {
    const std::string cut = "screens { name: \"front\"\n  grid { columns: 2 rows: 1\n  lower_left { x: 1 } }";
    const Expected<Wall> key = parseWall(cut, "x.wall");
    ASSERT_FALSE(key);
    EXPECT_EQ(key.error().message, "x.wall:3:3: unknown key \"lower_left\" here; is the '{' of grid in line 2 closed?");
    const Expected<Wall> end = parseWall("screens { name: \"front\"\n  grid { columns: 2 }\n", "x.wall");
    ASSERT_FALSE(end);
    EXPECT_WORDS(end.error().message);
}

TEST(WallText, PointsToAKeyWhoseValueStandsOnTheNextLine) {
    expectWordsAt("6:9", errorAfter("hosts { name: \"right\"\n", "hosts { nam\n: \"right\"\n"));
}

TEST(WallText, NamesTheNearestEnumerationValue) {
    expectWordsAt("5:68", errorAfter("eye: CENTER", "eye: CENTRE"));
    EXPECT_WORDS(errorAfter("late_frame: WAIT", "late_frame: hold"));
    expectWordsAt("8:1", errorAfter("late_frame: WAIT", "late_frame: 17"));
    expectWordsAt("7:3", errorAfter("column: 1 row: 0 eye: CENTER", "column: 1 row: 0 eye: 9"));
}

TEST(WallText, SaysWhereTextIsMalformed) {
    // (The words of most are protobuf's.)
    EXPECT_BEGINS(errorAfter("columns: 2", "columns: two"), "some/try.wall:3:19: ");
    EXPECT_BEGINS(errorAfter("columns: 2", "columns: 1.5"), "some/try.wall:3:19: ");
    EXPECT_BEGINS(errorAfter("columns: 2", "columns: 99999999999"), "some/try.wall:3:19: ");
    expectWordsAt("3:21", errorAfter("columns: 2", "columns: 2 columns: 3"));
    EXPECT_BEGINS(errorOf(std::string(kExample) + "}"), "some/try.wall:9:1: ");
    EXPECT_BEGINS(errorOf(std::string(kExample) + "hosts { name: \"unfinished"), "some/try.wall:9:");
    EXPECT_WORDS(errorOf(""));
    EXPECT_BEGINS(errorOf("\x7f"
                          "ELF\x01\x02"),
                  "some/try.wall:1:");
}

TEST(WallText, PointsToThePartThatMakesNoSense) {
    expectWordsAt("1:1", errorAfter("upper_left { x: -1.6", "upper_left { x: -1.2"));
    expectWordsAt("4:1", errorAfter("z: 2.4", "z: 2400"));
    expectWordsAt("7:3", errorAfter("column: 1", "column: 0"));
    expectWordsAt("6:1", errorAfter("name: \"right\"", "name: \"left\""));
    expectWordsAt("8:1", errorAfter("heartbeat_ms: 100", "heartbeat_ms: 500"));
    expectWordsAt("7:3", errorAfter("user: \"viewer\" } }\nsync", "user: \"viewr\" } }\nsync"));
    expectWordsAt("4:1", errorAfter("position { x: 0 y: 1.7 z: 2.4 }", ""));
    EXPECT_WORDS(errorAfter("grid { columns: 2 rows: 1 tile_width_px: 960 tile_height_px: 540 }", ""));
    EXPECT_WORDS(errorAfter("x: -1.6", "x: nan"));
    EXPECT_WORDS(errorAfter("frame_deadline_ms: 10000", "frame_deadline_ms: 9223372036854775807"));
}

TEST(WallText, IsUtf8AsHostsAreToldIt) {
    const Expected<Wall> wall = parseWall(kExample, "some/b\xfftry.wall");
    ASSERT_TRUE(wall) << wall.error().message;
    EXPECT_EQ(wall->name, "b?try") << "the file may be called anything";
    EXPECT_TRUE(decodeWall(encodeWall(*wall)));
    EXPECT_WORDS(errorAfter("hosts { name: \"left\"", "hosts { machine { ssh: \"wall@b\\377d\" } name: \"left\""));
    Wall other = *wall;
    other.hosts[0].tiles[0].output.warpFile = "b\xff.warp";
    const Expected<std::string> text = wallText(other);
    ASSERT_FALSE(text);
    EXPECT_EQ(text.error().code, ErrorCode::kBadInput);
    EXPECT_TRUE(parseWall(*wallText(*wall), "try.wall"));
}

TEST(WallText, RefusesDeepAndLargeText) {
    std::string deep;
    for (int i = 0; i < 100'000; ++i) deep += "hosts{";
    EXPECT_NE(errorOf(deep), "accepted");
    const Expected<Wall> large = parseWall(std::string(kMaxWallBytes + 1, '#'), "f");
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().code, ErrorCode::kLimit);
    std::string many;
    while (many.size() < kMaxWallBytes - 20) many += "hosts{}";
    EXPECT_WORDS(errorOf(many));
}

TEST(WallText, AnswersEveryTruncationAndFlippedByteWithAMessage) {
    const std::string text = kExample;
    for (std::size_t length = 0; length + 2 < text.size(); ++length) {
        const std::string message = errorOf(text.substr(0, length));
        EXPECT_FALSE(message.empty());
    }
    std::mt19937_64 random(3);
    for (int i = 0; i < 2000; ++i) {
        std::string damaged = text;
        for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
        EXPECT_FALSE(errorOf(damaged).empty());
    }
}

Wall variedWall() {
    Wall wall = *parseWall(kExample, "varied");
    wall.samples = 1;
    wall.nearMetres = 0.125;
    wall.culler = CullerKind::kFrustum;
    wall.screens[0].grid.columnWidthsPx = {101, 100};
    wall.screens[0].grid.tileWidthPx = 101;
    wall.screens[0].grid.bezelXPx = 7;
    wall.screens[0].grid.bezelYPx = 9;
    wall.users[0].orientation = Quatd(0.8, 0.1, 0.2, 0.3);
    wall.users[0].eyeSeparationMetres = 0.07;
    wall.hosts[0].tiles[0].eye = Eye::kLeft;
    wall.hosts[0].tiles.push_back(wall.hosts[0].tiles[0]);
    wall.hosts[0].tiles[1].eye = Eye::kRight;
    wall.sync = {.lateFrame = LateFramePolicy::kDrop,
                 .frameDeadline = std::chrono::milliseconds(777),
                 .firstFrameDeadline = std::chrono::milliseconds(8888),
                 .lateAfter = std::chrono::milliseconds(33),
                 .heartbeat = std::chrono::milliseconds(11),
                 .lostAfter = std::chrono::milliseconds(99),
                 .startDeadline = std::chrono::milliseconds(555)};
    return wall;
}

TEST(WallBytes, BringEverythingBack) {
    const Wall wall = variedWall();
    const Expected<Wall> back = decodeWall(encodeWall(wall));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(encodeWall(*back), encodeWall(wall));
    EXPECT_EQ(back->name, "varied");
    EXPECT_EQ(back->samples, 1);
    EXPECT_EQ(back->culler, CullerKind::kFrustum);
    EXPECT_EQ(back->sync, wall.sync);
    EXPECT_EQ(back->screens[0].upperLeft, wall.screens[0].upperLeft) << "to the last bit: cameras depend on it";
    EXPECT_EQ(back->screens[0].grid.columnWidthsPx, wall.screens[0].grid.columnWidthsPx);
    EXPECT_EQ(back->users[0].orientation.coeffs(), wall.users[0].orientation.coeffs());
    const std::vector<Tile> before = layoutTiles(wall), after = layoutTiles(*back);
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) {
        EXPECT_EQ(before[i].name, after[i].name);
        EXPECT_EQ(before[i].rect, after[i].rect);
    }
}

TEST(WallBytes, NeverCrashWhateverTheyAre) {
    const Bytes whole = encodeWall(variedWall());
    for (std::size_t length = 0; length < whole.size(); ++length) {
        (void)decodeWall(ByteSpan(whole).first(length));
    }
    std::mt19937_64 random(5);
    for (int i = 0; i < 3000; ++i) {
        Bytes damaged = whole;
        for (int k = 0; k < 4; ++k) damaged[random() % damaged.size()] = static_cast<std::byte>(random());
        const Expected<Wall> wall = decodeWall(damaged);
        EXPECT_TRUE(!wall || checkWall(*wall));
    }
    EXPECT_FALSE(decodeWall({}));
    EXPECT_EQ(decodeWall(Bytes(kMaxWallWireBytes + 1)).error().code, ErrorCode::kLimit);
}

class WallFiles : public testing::Test {
protected:
    WallFiles() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
    }
    ~WallFiles() override { fs::remove_all(folder_); }
    void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

    fs::path folder_;
};

TEST_F(WallFiles, AreFoundByNameOrByPath) {
    write("lab.wall", kExample);
    const std::vector<std::string> folders{"/nonexistent", folder_.string()};
    const std::string path = (folder_ / "lab.wall").string();
    EXPECT_EQ(*resolveWallPath("lab", folders), path);
    EXPECT_EQ(*resolveWallPath(path, {}), path);
    const Expected<std::string> missing = resolveWallPath("lap", folders);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
    EXPECT_EQ(missing.error().message,
              "there is no wall \"lap\", neither shipped nor as a file (did you mean \"lab\"?); shipped: lab");
    EXPECT_FALSE(resolveWallPath("", folders));
    EXPECT_FALSE(resolveWallPath("../" + folder_.filename().string() + "/lab", folders)) << "a path is not a name";
}

TEST_F(WallFiles, AreLoadedWithTheirNameInFrontOfErrors) {
    write("good.wall", kExample);
    const Expected<Wall> good = loadWall((folder_ / "good.wall").string());
    ASSERT_TRUE(good) << good.error().message;
    EXPECT_EQ(good->name, "good");
    write("bad.wall", "screens { nam: \"x\" }");
    const std::string bad = loadWall((folder_ / "bad.wall").string()).error().message;
    EXPECT_BEGINS(bad, (folder_ / "bad.wall").string() + ":1:11: ");
    EXPECT_WORDS(bad);
}

TEST_F(WallFiles, ThatAreNoFilesAreRefused) {
    EXPECT_EQ(loadWall((folder_ / "none.wall").string()).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(loadWall(folder_.string()).error().code, ErrorCode::kBadInput);
    write("good.wall", kExample);
    EXPECT_WORDS(loadWall((folder_ / "god.wall").string()).error().message);
    for (const char* others : {"{\"version\": 1}", "\n<pvx>", "PK\3\4", "\xFF\xFE<", "\xFE\xFF"}) {
        std::ofstream(folder_ / "theirs") << others;
        const std::string message = loadWall((folder_ / "theirs").string()).error().message;
        EXPECT_WORDS(message);
    }
    EXPECT_EQ(loadWall("/dev/zero").error().code, ErrorCode::kBadInput);
    write("huge.wall", std::string(2 * kMaxWallBytes, ' '));
    EXPECT_EQ(loadWall((folder_ / "huge.wall").string()).error().code, ErrorCode::kLimit);
}

// ---- the walls in deploy/walls
// ---------------------------------------------------------------------------------------

Wall shipped(const std::string& name) {
    const std::vector<std::string> folders{TESSERA_SOURCE_DIR "/deploy/walls"};
    const Expected<Wall> wall = loadWall(resolveWallPath(name, folders).value_or(""));
    EXPECT_TRUE(wall) << name << ": " << wall.error().message;
    return wall.value_or(Wall());
}

TEST(ShippedWalls, AllLoad) {
    int count = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(TESSERA_SOURCE_DIR "/deploy/walls")) {
        if (entry.path().extension() != ".wall") continue;
        const Wall wall = shipped(entry.path().stem().string());
        EXPECT_EQ(wall.sync, SyncPolicy()) << wall.name;
        ++count;
    }
    EXPECT_GE(count, 5);
}

/// The wall that deploy/real-screens.md begins with, as it stands there.
TEST(ShippedWalls, TheExampleOfThePageOnRealScreensLoads) {
    std::ifstream page(TESSERA_SOURCE_DIR "/deploy/real-screens.md");
    std::string text;
    for (std::string line; std::getline(page, line);)
        if (line.starts_with("    screens {") || line.starts_with("      lower_left") ||
            line.starts_with("      grid") || line.starts_with("    users {") ||
            line.starts_with("    hosts { name: \"here\""))
            text += line + "\n";
    const Expected<Wall> wall = parseWall(text, "real-screens.md");
    ASSERT_TRUE(wall) << wall.error().message << "\n" << text;
    const ScreenPixels pixels = screenPixels(wall->screens.at(0));
    EXPECT_NEAR(pixels.width / wall->screens[0].widthMetres(), pixels.height / wall->screens[0].heightMetres(), 10)
        << "pixels are square";
}

TEST(ShippedWalls, AreFoundFromABuildFolder) {
    EXPECT_TRUE(findWall("2x2", TESSERA_SOURCE_DIR "/build/bin/tessera-server"));
}

TEST(ShippedScenes, AreKnownByTheirNames) {
    const std::string program = TESSERA_SOURCE_DIR "/build/bin/tessera-server";
    EXPECT_EQ(*findScene("materials", program), TESSERA_SOURCE_DIR "/deploy/scenes/materials.tsct");
    EXPECT_EQ(*findScene("/nowhere/materials", program), "/nowhere/materials") << "a path is not a name";
    EXPECT_EQ(*findScene("hall.gltf", program), "hall.gltf");
    EXPECT_EQ(*findScene("asset://materials.tsct", program), "asset://materials.tsct");
    const Expected<std::string> near = findScene(TESSERA_SOURCE_DIR "/deploy/scenes/materals.tsct", program);
    ASSERT_FALSE(near);
    EXPECT_WORDS(near.error().message);
    const Expected<std::string> missing = findScene("engine-hal", program);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(missing.error().message);
}

TEST(ShippedWalls, FlatOnesHaveTheSameCameraInEveryBit) {
    const Wall one = shipped("1x1");
    View view;
    view.orientation = Quatd(Eigen::AngleAxisd(0.3, Vec3d::UnitY()));
    const ScreenCamera expected = tileCamera(one, layoutTiles(one)[0], view);
    for (const char* name : {"2x2", "3x1"}) {
        const Wall wall = shipped(name);
        for (const Tile& tile : layoutTiles(wall)) {
            const ScreenCamera camera = tileCamera(wall, tile, view);
            EXPECT_EQ(camera.clip_T_eye, expected.clip_T_eye);
            EXPECT_EQ(camera.eye_T_world.matrix(), expected.eye_T_world.matrix());
            EXPECT_EQ(camera.pixels.width, expected.pixels.width);
            EXPECT_EQ(camera.pixels.height, expected.pixels.height);
        }
    }
    EXPECT_EQ(layoutTiles(one).size(), 1u);
    EXPECT_EQ(layoutTiles(shipped("2x2")).size(), 4u);
    EXPECT_EQ(layoutTiles(shipped("3x1")).size(), 3u);
}

TEST(ShippedWalls, HaveSquarePixels) {
    // Of displays that were measured the pixels are square to a part in a thousand.
    for (const auto& [name, tolerance] : {std::pair{"1x1", 1e-9},
                                          {"2x2", 1e-9},
                                          {"3x1", 1e-9},
                                          {"3x1-bezels", 1e-9},
                                          {"cave4", 1e-9},
                                          {"cave4-stereo", 1e-9},
                                          {"5-sided", 1e-9},
                                          {"curved-9x2", 3.0},
                                          {"powerwall-4k-2x3", 1.0},
                                          {"two-users", 1e-9}}) {
        for (const Screen& screen : shipped(name).screens) {
            const ScreenPixels pixels = screenPixels(screen);
            EXPECT_NEAR(pixels.width / screen.widthMetres(), pixels.height / screen.heightMetres(), tolerance)
                << name << " " << screen.name;
        }
    }
    EXPECT_EQ(screenPixels(shipped("3x1-bezels").screens[0]).width, 2000);
}

TEST(ShippedWalls, CaveScreensShareTheirEdges) {
    const Wall cave = shipped("cave4");
    const auto corner = [&](const char* name, bool right, bool upper) {
        const Screen& s = *cave.findScreen(name);
        return Vec3d((right ? s.lowerRight : s.lowerLeft) +
                     (upper ? Vec3d(s.upperLeft - s.lowerLeft) : Vec3d::Zero().eval()));
    };
    for (const bool upper : {false, true}) {
        EXPECT_EQ(corner("left", true, upper), corner("front", false, upper));
        EXPECT_EQ(corner("front", true, upper), corner("right", false, upper));
    }
    EXPECT_EQ(corner("floor", false, true), corner("front", false, false));
    EXPECT_EQ(corner("floor", true, true), corner("front", true, false));
}

}  // namespace
}  // namespace tessera
