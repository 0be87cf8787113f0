#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "common/wall/View.h"
#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"
#include "tests/bench/SideProcess.h"
#include "tests/bench/WallReading.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

constexpr int kTurn = 120;  // frames of a way around the mesh
const Vec3d kBunny(-0.0168, 0.1101, -0.0015);
constexpr double kDistance = 0.3, kScale = 0.125;  // world units, and of them per metre of the wall

/// Two columns and two rows of square tiles; the hosts draw one tile each, or one of them all.
std::string wallOf(int sidePx, int samples, bool oneHost) {
    std::string text = fmt::format(
        "samples: {1}\n"
        "screens {{ name: \"front\" lower_left {{ x: -0.8 y: 0.9 z: 0 }} lower_right {{ x: 0.8 y: 0.9 z: 0 }}\n"
        "  upper_left {{ x: -0.8 y: 2.5 z: 0 }} grid {{ columns: 2 rows: 2 tile_width_px: {0} tile_height_px: {0} }} "
        "}}\n"
        "users {{ name: \"viewer\" position {{ x: 0 y: 1.7 z: 2.4 }} }}\n"
        "sync {{ late_frame: WAIT frame_deadline_ms: 10000 heartbeat_ms: 100 lost_after_ms: 800 }}\n",
        sidePx, samples);
    std::array<std::string, 4> tiles;
    for (int i = 0; i < 4; ++i)
        tiles[static_cast<std::size_t>(i)] =
            fmt::format("tiles {{ screen: \"front\" column: {} row: {} eye: CENTER user: \"viewer\" }}", i % 2, i / 2);
    // lower-left, lower-right, upper-left, upper-right, as kFourHosts has them.
    if (oneHost)
        return text + fmt::format("hosts {{ name: \"all\" {} {} {} {} }}\n", tiles[0], tiles[1], tiles[2], tiles[3]);
    for (std::size_t i = 0; i < 4; ++i)
        text += fmt::format("hosts {{ name: \"{}\" {} }}\n", test::kFourHosts[i], tiles[i]);
    return text;
}

/// A camera that turns about the mesh, once in kTurn frames.
std::string turningCamera() {
    std::string keys;
    for (int i = 0; i <= 4; ++i)
        keys += fmt::format(
            "key {{ time: {} transform {{ translation {{ x: {} y: {} z: {} }} rotation {{ axis {{ y: 1 }} angle_deg: "
            "{} }} }} }}\n",
            kTurn / 60.0 / 4 * i, kBunny.x(), kBunny.y(), kBunny.z(), 90 * i);
    return fmt::format(
        "node {{ name: \"turn\" transform {{ translation {{ x: {} y: {} z: {} }} }}\n"
        "  node {{ name: \"way\" motion {{ mode: LOOP\n{} }} }}\n"
        "  node {{ name: \"camera\" transform {{ translation {{ y: {} z: {} }} }} camera {{ world_units_per_metre: {} "
        "}} }} }}\n",
        kBunny.x(), kBunny.y(), kBunny.z(), keys, -1.7 * kScale, kDistance - 2.4 * kScale, kScale);
}

struct TurnCost {
    double frameMs = 0, processorMs = 0;  ///< a frame; of the clients together
};

/// Mean of whole turns of the camera, after one.
std::optional<TurnCost> measureWall(SceneTable& table, const std::string& wallText,
                                    const std::vector<std::string>& hosts, const std::string& scene, int turns,
                                    const std::vector<std::string>& client = {}) {
    const test::TemporaryFolder folder;
    test::LiveWallOptions options;
    options.wall = folder.write("square.wall", wallText);
    options.scene = scene;
    options.size.clear();
    options.server = {"--scene", folder.write("camera.tsct", turningCamera()), "--assets", "/usr/share/assimp/models"};
    test::LiveWall wall(options);
    if (wall.address().empty()) {
        table.complain("the server of a wall did not listen:\n" + wall.logs());
        return std::nullopt;
    }
    for (const std::string& host : hosts) wall.startClient(host, client);
    if (!wall.waitForFrame(fourTiles().front(), kTurn / 2, 120s)) {
        table.complain("a wall shows nothing:\n" + wall.logs());
        return std::nullopt;
    }
    const WallReading before = readWall(wall, hosts, fourTiles());
    WallReading after = before;
    // Seldom, as looking takes time from those who are looked at.
    while (after.frame < before.frame + kTurn * turns && after.at - before.at < 120s) {
        std::this_thread::sleep_for(100ms);
        after = readWall(wall, hosts, fourTiles());
    }
    (void)wall.finish();
    const double frames = static_cast<double>(after.frame - before.frame);
    if (frames <= 0) {
        table.complain("a wall stands still:\n" + wall.logs());
        return std::nullopt;
    }
    return TurnCost{1e3 * std::chrono::duration<double>(after.at - before.at).count() / frames,
                    1e3 * (after.clients - before.clients) / frames};
}

/// What bench_drawing_floor reads.
std::string writeMesh(const test::TemporaryFolder& folder, const Geometry& mesh) {
    std::string path = folder.path() + "/mesh";
    std::ofstream file(path, std::ios::binary);
    const std::array<std::uint32_t, 2> counts = {static_cast<std::uint32_t>(mesh.positions.sizeBytes() / 12),
                                                 static_cast<std::uint32_t>(mesh.indices.sizeBytes() / 4)};
    const auto write = [&](ByteSpan bytes) {
        file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    };
    write(std::as_bytes(std::span(counts)));
    write(mesh.positions.bytes());
    write(mesh.normals.bytes());
    write(mesh.indices.bytes());
    return path;
}

/// A frame of the floor: means of a turn.
std::optional<double> measureFloor(SceneTable& table, const Geometry& mesh, const std::string& program,
                                   const std::string& sides) {
    const test::TemporaryFolder folder;
    SideProcess floor({"/usr/bin/env", "LP_NUM_THREADS=2", program, writeMesh(folder, mesh), "800", "800", sides});
    if (!floor.said("ready")) {
        table.complain("bench_drawing_floor did not start");
        return std::nullopt;
    }
    Screen screen;
    screen.lowerLeft = {-0.8, 0.9, 0};
    screen.lowerRight = {0.8, 0.9, 0};
    screen.upperLeft = {-0.8, 2.5, 0};
    screen.grid = {.columns = 2, .rows = 2, .tileWidthPx = 400, .tileHeightPx = 400};
    User user;
    user.position = {0, 1.7, 2.4};
    double total = 0;
    for (int i = -10; i < kTurn; ++i) {
        View view;
        view.orientation = Quatd(Eigen::AngleAxisd(2 * M_PI * i / kTurn, Vec3d::UnitY()));
        view.position = kBunny + view.orientation * Vec3d(0, -1.7 * kScale, kDistance - 2.4 * kScale);
        view.worldUnitsPerMetre = kScale;
        const ScreenCamera camera = screenCamera(screen, user, Eye::kCenter, view);
        const Mat4d clip_T_world = camera.clip_T_eye * camera.eye_T_world.matrix();
        const std::vector<double> answer =
            floor.ask(fmt::format("{}", fmt::join(clip_T_world.data(), clip_T_world.data() + 16, " ")), 2);
        if (answer[1] < 0.1 * 800 * 800) table.complain("the floor does not draw the mesh");
        if (i >= 0) total += answer[0] / kTurn;
    }
    return total;
}

/// Ranks that draw a tile each, and the client that leads them, as ParaView's guide has it; nothing where it is not
/// installed.
std::optional<double> measureParaView(SceneTable& table, const std::string& scan) {
    if (std::system("command -v pvserver pvpython mpirun xvfb-run >/dev/null 2>&1") != 0) {
        table.skip("ParaView's tile display: apt-get install paraview python3-paraview openmpi-bin xvfb xauth");
        return std::nullopt;
    }
    SideProcess client({"/bin/bash", TESSERA_SOURCE_DIR "/tests/bench/DrawingParaView.sh", scan});
    if (!client.said("ready")) {
        table.skip("ParaView's tile display did not start");
        return std::nullopt;
    }
    double total = 0;
    for (int i = -10; i < kTurn; ++i) {
        const double taken = client.ask(fmt::format("{}", 360.0 * i / kTurn), 1)[0];
        if (i >= 0) total += taken / kTurn;
    }
    return total;
}

Median once(double value) {
    return {.value = value, .spread = 0, .count = 1};
}

}  // namespace

void bunnyWallRows(SceneTable& table, const std::string& scan, const std::string& programs) {
    table.begin("bunny, 2x2 tiles of 400x400, one sample, camera moving; wall time of a frame");
    const auto meshes = readGeometries({scan});
    if (!meshes || meshes->empty()) {
        table.skip(meshes ? scan + ": no mesh" : meshes.error().message);
        return;
    }
    const auto ours = measureWall(table, wallOf(400, 1, false), test::kFourHosts, scan, 2);
    if (!ours) return;
    const std::string remark = fmt::format("{:.1f} ms of processor time", ours->processorMs);
    // A scan does not say which of its sides is outside, and has holes: a wall draws both.
    for (const std::string sides : {"both", "front"}) {
        const auto floor = measureFloor(table, meshes->front(), programs + "/bench_drawing_floor", sides);
        if (!floor) continue;
        table.add({.operation = "a frame of the wall",
                   .peer = sides == "both" ? "plain OpenGL, once" : "plain OpenGL, once, front faces alone",
                   .ours = once(ours->frameMs),
                   .theirs = once(*floor),
                   .unit = "ms",
                   .atMost = 1.5,
                   .aim = 1.2,
                   .remark = remark});
    }
    if (const auto theirs = measureParaView(table, scan))
        table.add({.operation = "a frame of the wall",
                   .peer = "ParaView's tile display",
                   .ours = once(ours->frameMs),
                   .theirs = once(*theirs),
                   .unit = "ms",
                   .atMost = 0.3,
                   .aim = 0.15,
                   .remark = remark});
}

void oneProcessRows(SceneTable& table) {
    table.begin("engine hall, four tiles of 540x540, four samples; wall time of a frame");
    const std::string scene = TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct";
    const auto four = measureWall(table, wallOf(540, 4, false), test::kFourHosts, scene, 1);
    const auto one = measureWall(table, wallOf(540, 4, true), {"all"}, scene, 1,
                                 {"--threads", std::to_string(std::thread::hardware_concurrency())});
    if (!four || !one) return;
    table.add({.operation = "one process that draws four tiles",
               .peer = "four processes",
               .ours = once(one->frameMs),
               .theirs = once(four->frameMs),
               .unit = "ms",
               .atMost = 1 / 0.75,
               .remark = fmt::format("processor time {:.0f} and {:.0f} ms", one->processorMs, four->processorMs)});
}

}  // namespace tessera::bench
