// The stitched tiles of a flat wall are the one big picture, byte for byte.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cstdlib>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>

#include "common/codec/WallCodec.h"
#include "tests/golden/SeamScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

ScreenCamera cameraOf(const Wall& wall, Eye eye) {
    return screenCamera(wall.screens.front(), wall.users.front(), eye, {});
}

struct Cut {
    const char* name;
    Screen::Grid grid;
    int samples;
    Eye eye = Eye::kCenter;
    bool mapped = false;
    bool lit = false;    ///< with surroundings, shadows, many lights
    bool lamps = false;  ///< and point lights that have shadows
};
std::ostream& operator<<(std::ostream& out, const Cut& cut) {
    return out << cut.name;
}

class Seams : public testing::TestWithParam<Cut> {};

TEST_P(Seams, AreNotThere) {
    const Cut& cut = GetParam();
    const Wall wall = makeWall(cut.grid, cut.eye);
    const ScreenCamera camera = cameraOf(wall, cut.eye);
    const Aspect aspect = makeSeamScene(true, cut.mapped, cut.lit, cut.lamps);
    RenderScene scene;
    scene.update(aspect, nullptr);
    Stage stage(cut.samples);
    const PixelRect all{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
    const Picture whole = drawPart(stage, aspect, scene, CullerKind::kNone, camera, all);
    EXPECT_GT(lookOf(whole).spread, 25) << "a picture without content proves nothing";
    for (const Tile& tile : layoutTiles(wall)) {
        // A renderer of its own, as a host of its own has: nothing is left over from the big picture.
        Stage own(cut.samples);
        const Picture picture = drawPart(own, aspect, scene, CullerKind::kFrustum, camera, tile.rect);
        EXPECT_EQ(differingPixels(picture, cropOf(whole, tile.rect)), 0u) << tile.name;
        EXPECT_GT(lookOf(picture).mean, 20) << tile.name << " is black";
        EXPECT_GT(lookOf(picture).spread, 8) << tile.name << " is blank";
    }
}

INSTANTIATE_TEST_SUITE_P(
    Walls, Seams,
    testing::Values(
        Cut{"TwoByTwo", {.columns = 2, .rows = 2, .tileWidthPx = 320, .tileHeightPx = 180}, 4},
        Cut{"ThreeByOneOdd", {.columns = 3, .rows = 1, .columnWidthsPx = {214, 213, 213}, .rowHeightsPx = {361}}, 4},
        Cut{"OddInBothDirections",
            {.columns = 3, .rows = 3, .columnWidthsPx = {101, 67, 203}, .rowHeightsPx = {63, 65, 129}},
            4},
        Cut{"Bezels",
            {.columns = 3, .rows = 2, .tileWidthPx = 150, .tileHeightPx = 110, .bezelXPx = 17, .bezelYPx = 9},
            4},
        Cut{"Overlaps", {.columns = 2, .rows = 1, .tileWidthPx = 300, .tileHeightPx = 200, .overlapXPx = 37}, 4},
        Cut{"LeftEye", {.columns = 2, .rows = 2, .tileWidthPx = 200, .tileHeightPx = 120}, 4, Eye::kLeft},
        Cut{"RightEye", {.columns = 2, .rows = 2, .tileWidthPx = 200, .tileHeightPx = 120}, 4, Eye::kRight},
        Cut{"Mapped", {.columns = 2, .rows = 2, .tileWidthPx = 320, .tileHeightPx = 180}, 4, Eye::kCenter, true},
        Cut{"MappedOddOneSample",
            {.columns = 3, .rows = 3, .columnWidthsPx = {101, 67, 203}, .rowHeightsPx = {63, 65, 129}},
            1,
            Eye::kCenter,
            true},
        Cut{"LitOddOneSample",
            {.columns = 3, .rows = 3, .columnWidthsPx = {101, 67, 203}, .rowHeightsPx = {63, 65, 129}},
            1,
            Eye::kCenter,
            false,
            true},
        Cut{"LampsOddOneSample",
            {.columns = 3, .rows = 3, .columnWidthsPx = {101, 67, 203}, .rowHeightsPx = {63, 65, 129}},
            1,
            Eye::kCenter,
            false,
            true,
            true},
        Cut{"PowersOfTwo", {.columns = 2, .rows = 2, .tileWidthPx = 512, .tileHeightPx = 256}, 1}),
    [](const testing::TestParamInfo<Cut>& cut) { return cut.param.name; });
// Large ones, and twins of those above.
INSTANTIATE_TEST_SUITE_P(
    MoreWalls, Seams,
    testing::Values(
        Cut{"TwoByTwoOneSample", {.columns = 2, .rows = 2, .tileWidthPx = 320, .tileHeightPx = 180}, 1},
        Cut{"OddOneSample",
            {.columns = 3, .rows = 3, .columnWidthsPx = {101, 67, 203}, .rowHeightsPx = {63, 65, 129}},
            1},
        Cut{"RealTwoByTwo", {.columns = 2, .rows = 2, .tileWidthPx = 960, .tileHeightPx = 540}, 4},
        Cut{"FourK", {.columns = 2, .rows = 2, .tileWidthPx = 1920, .tileHeightPx = 1080, .bezelXPx = 31}, 1},
        Cut{"MappedReal", {.columns = 2, .rows = 2, .tileWidthPx = 960, .tileHeightPx = 540}, 4, Eye::kLeft, true},
        Cut{"Lit", {.columns = 2, .rows = 2, .tileWidthPx = 320, .tileHeightPx = 180}, 4, Eye::kCenter, true, true},
        Cut{"LitReal", {.columns = 2, .rows = 2, .tileWidthPx = 960, .tileHeightPx = 540}, 4, Eye::kRight, false, true},
        Cut{"Lamps",
            {.columns = 2, .rows = 2, .tileWidthPx = 320, .tileHeightPx = 180},
            4,
            Eye::kLeft,
            true,
            true,
            true}),
    [](const testing::TestParamInfo<Cut>& cut) { return cut.param.name; });

TEST(Seams, OneRendererDrawsTilesInAnyOrder) {
    const Wall wall = makeWall({.columns = 2, .rows = 2, .tileWidthPx = 200, .tileHeightPx = 113});
    const ScreenCamera camera = cameraOf(wall, Eye::kCenter);
    const Aspect aspect = makeSeamScene();
    RenderScene scene;
    scene.update(aspect, nullptr);
    Stage stage(4);
    const std::vector<Tile> tiles = layoutTiles(wall);
    std::vector<Picture> first;
    for (const Tile& tile : tiles)
        first.push_back(drawPart(stage, aspect, scene, CullerKind::kNone, camera, tile.rect));
    for (std::size_t i = tiles.size(); i-- > 0;)
        EXPECT_EQ(differingPixels(drawPart(stage, aspect, scene, CullerKind::kNone, camera, tiles[i].rect), first[i]),
                  0u);
}

// ---- in separate processes, with different numbers of threads ------------------------------------------------------

const Screen::Grid kProcessGrid{.columns = 2, .rows = 2, .columnWidthsPx = {321, 319}, .rowHeightsPx = {181, 179}};
constexpr char kTileVariable[] = "TESSERA_GOLDEN_TILE";
constexpr char kOutputVariable[] = "TESSERA_GOLDEN_OUTPUT";

/// What the processes do that Seams.AreNotThereBetweenProcesses starts.
void drawOneTileToAFile(const char* index, const char* output) {
    const Wall wall = makeWall(kProcessGrid);
    const ScreenCamera camera = cameraOf(wall, Eye::kCenter);
    const std::vector<Tile> tiles = layoutTiles(wall);
    const int which = std::atoi(index);
    const PixelRect all{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
    const Aspect aspect = makeSeamScene();
    RenderScene scene;
    scene.update(aspect, nullptr);
    Stage stage(4);
    const bool whole = which < 0;
    const Picture picture = drawPart(stage, aspect, scene, whole ? CullerKind::kNone : CullerKind::kFrustum, camera,
                                     whole ? all : tiles[static_cast<std::size_t>(which)].rect);
    ASSERT_TRUE(writeFile(output, encodePng(picture, std::nullopt)));
}

Picture drawnByAnotherProcess(int tile, int threads, const std::string& folder) {
    const std::string output = folder + "/" + std::to_string(tile) + "-" + std::to_string(threads) + ".png";
    const std::string self = std::filesystem::read_symlink("/proc/self/exe");
    std::vector<std::string> variables{std::string(kTileVariable) + "=" + std::to_string(tile),
                                       std::string(kOutputVariable) + "=" + output,
                                       "LP_NUM_THREADS=" + std::to_string(threads)};
    // (Which of the tests are this program's part does not bind the other one.)
    for (char** variable = environ; *variable; ++variable)
        if (!std::string_view(*variable).starts_with("GTEST_")) variables.emplace_back(*variable);
    std::vector<char*> environment;
    for (std::string& variable : variables) environment.push_back(variable.data());
    environment.push_back(nullptr);
    std::string filter = "--gtest_filter=Seams.AreNotThereBetweenProcesses";
    std::string program = self;
    char* arguments[] = {program.data(), filter.data(), nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    EXPECT_EQ(::posix_spawn(&child, self.c_str(), &actions, nullptr, arguments, environment.data()), 0);
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "tile " << tile;
    const auto bytes = readFile(output, 100'000'000);
    EXPECT_TRUE(bytes);
    const auto decoded = bytes ? decodePng(*bytes) : fail(ErrorCode::kFailed, "no file");
    EXPECT_TRUE(decoded);
    return decoded ? decoded->picture : Picture{};
}

TEST(Seams, AreNotThereBetweenProcesses) {
    // The test starts itself, with a tile to draw in its environment.
    const char* index = std::getenv(kTileVariable);
    const char* output = std::getenv(kOutputVariable);
    if (index && output) return drawOneTileToAFile(index, output);
    std::string pattern = testing::TempDir() + "tessera-seams-XXXXXX";
    const std::string folder = ::mkdtemp(pattern.data());
    const Picture whole = drawnByAnotherProcess(-1, 2, folder);
    const std::vector<Tile> tiles = layoutTiles(makeWall(kProcessGrid));
    ASSERT_EQ(whole.widthPx, 640);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const Picture tile = drawnByAnotherProcess(static_cast<int>(i), i % 2 ? 0 : 1, folder);
        EXPECT_EQ(differingPixels(tile, cropOf(whole, tiles[i].rect)), 0u) << tiles[i].name;
    }
    std::filesystem::remove_all(folder);
}

// ---- the shipped walls ---------------------------------------------------------------------------------------------

class ShippedWall : public testing::TestWithParam<const char*> {};

TEST_P(ShippedWall, IsLoadedAndDrawn) {
    const auto loaded = loadWall(std::string(TESSERA_SOURCE_DIR "/deploy/walls/") + GetParam() + ".wall");
    ASSERT_TRUE(loaded) << loaded.error().message;
    const auto wall = withSize(*loaded, 251 * static_cast<int>(loaded->screens.size()), 173);
    ASSERT_TRUE(wall) << wall.error().message;
    const Aspect aspect = makeSeamScene();
    RenderScene scene;
    scene.update(aspect, nullptr);
    const View view = defaultView(*wall, scene.bounds());
    Stage stage(wall->samples);
    for (const Screen& screen : wall->screens) {
        std::map<Eye, Picture> wholes;
        for (const Tile& tile : layoutTiles(*wall)) {
            if (tile.screen != screen.name) continue;
            Picture& whole = wholes[tile.eye];
            const User* user = wall->findUser(tile.user);
            ASSERT_NE(user, nullptr);
            const ScreenCamera camera = screenCamera(screen, *user, tile.eye, view);
            if (whole.rgb.empty())
                whole = drawPart(stage, aspect, scene, CullerKind::kNone, camera,
                                 {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height});
            const Picture picture = drawPart(stage, aspect, scene, CullerKind::kMasked, camera, tile.rect);
            EXPECT_EQ(differingPixels(picture, cropOf(whole, tile.rect)), 0u) << tile.name;
        }
        for (const auto& [eye, whole] : wholes) EXPECT_GT(lookOf(whole).mean, 10) << screen.name;
    }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedWall,
                         testing::Values("1x1", "2x2", "3x1", "3x1-bezels", "cave4", "cave4-stereo", "5-sided",
                                         "curved-9x2", "powerwall-4k-2x3", "two-users"),
                         [](const auto& name) {
                             std::string text = name.param;
                             std::erase(text, '-');
                             return text;
                         });

// ---- screens that meet at an angle ---------------------------------------------------------------------------------

struct Corner {
    Screen left, front;
    User user;
};

/// A front screen and one on its left, square, at right angles; the user stands anywhere between them.
Corner makeCorner(int sidePx) {
    Corner corner;
    corner.front.name = "front";
    corner.front.lowerLeft = {-1.2, 0, 0};
    corner.front.lowerRight = {1.2, 0, 0};
    corner.front.upperLeft = {-1.2, 2.4, 0};
    corner.left.name = "left";
    corner.left.lowerLeft = {-1.2, 0, 2.4};
    corner.left.lowerRight = {-1.2, 0, 0};
    corner.left.upperLeft = {-1.2, 2.4, 2.4};
    for (Screen* screen : {&corner.left, &corner.front}) screen->grid = {.tileWidthPx = sidePx, .tileHeightPx = sidePx};
    corner.user.position = {0.1, 1.7, 1.3};
    return corner;
}

TEST(Corners, APointOnTheSharedEdgeLandsAtTheSameHeightInBothScreens) {
    const Corner corner = makeCorner(400);
    View view;
    view.position = {3, 4, 5};
    view.orientation = Quatd(0.9, 0.1, 0.3, 0.2).normalized();
    view.worldUnitsPerMetre = 2.5;
    for (const Eye eye : {Eye::kCenter, Eye::kLeft, Eye::kRight}) {
        const ScreenCamera left = screenCamera(corner.left, corner.user, eye, view);
        const ScreenCamera front = screenCamera(corner.front, corner.user, eye, view);
        for (double height = 0.1; height < 2.4; height += 0.23) {
            for (const double reach : {0.7, 1.0, 8.0}) {
                // On the ray from the eye through the edge, before, on and behind it.
                const Vec3d eyeWall = corner.user.eye(eye);
                const Vec3d wallPoint = eyeWall + reach * (Vec3d(-1.2, height, 0) - eyeWall);
                const Vec3d world = view.world_T_wall() * wallPoint;
                const auto ndc = [&](const ScreenCamera& camera) {
                    const Vec3d inEye = camera.eye_T_world * world;
                    const Vec4d clip = camera.clip_T_eye * Vec4d(inEye.x(), inEye.y(), inEye.z(), 1);
                    return Vec3d(clip.head<3>() / clip.w());
                };
                EXPECT_NEAR(ndc(left).x(), 1, 1e-9);
                EXPECT_NEAR(ndc(front).x(), -1, 1e-9);
                EXPECT_NEAR(ndc(left).y(), ndc(front).y(), 1e-9);
                EXPECT_NEAR(ndc(left).y(), 2 * height / 2.4 - 1, 1e-9);
            }
        }
    }
}

TEST(Corners, ThePictureGoesOnAcrossTheCorner) {
    constexpr int kSidePx = 256;
    const Corner corner = makeCorner(kSidePx);
    TestScene content;
    content.setDark();
    // Glowing bars that run through the corner of the room, far behind it.
    for (int i = 0; i < 12; ++i) {
        Material bar;
        bar.baseColor = Vec4f(0, 0, 0, 1);
        bar.emissive = Vec3f(i % 2 ? 0.7f : 0.1f, 0.06f * static_cast<float>(i), 0.7f - 0.05f * static_cast<float>(i));
        content.place(content.add(makeBox({16, 1, 0.1}), content.add(bar)), {-4, -4.0 + i, -4},
                      Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitY())));
    }
    const Aspect aspect = content.take();
    RenderScene scene;
    scene.update(aspect, nullptr);
    Stage stage(4);
    const PixelRect all{.x = 0, .y = 0, .width = kSidePx, .height = kSidePx};
    const auto drawScreen = [&](const Screen& screen) {
        return drawPart(stage, aspect, scene, CullerKind::kFrustum, screenCamera(screen, corner.user, Eye::kCenter, {}),
                        all);
    };
    const Picture left = drawScreen(corner.left), front = drawScreen(corner.front);
    int differing = 0, changes = 0;
    for (int y = 0; y < kSidePx; ++y) {
        const std::size_t row = 3 * static_cast<std::size_t>(y) * kSidePx;
        const std::size_t last = row + 3 * (kSidePx - 1);
        int step = 0;
        for (std::size_t c = 0; c < 3; ++c) step = std::max(step, std::abs(left.rgb[last + c] - front.rgb[row + c]));
        differing += step > 8;
        if (y > 0) changes += left.rgb[last] != left.rgb[last - 3 * kSidePx];
    }
    EXPECT_GT(changes, 5) << "bars cross the corner";
    // The two columns lie half a pixel on either side of the edge: at a bar's rim they may fall on different bars.
    EXPECT_LE(differing, 2 * changes);
    EXPECT_LT(differing, kSidePx / 8);
}

}  // namespace
}  // namespace tessera::test
