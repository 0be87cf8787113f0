/// Drawing: what is seen of large scenes, empty tiles, first frames, reading back; beside oracles, floors and peers in
/// the same run. `--rows GROUP,…`: city, city-large, plant, scan, field, points, glyphs, empty, first, shadows, osg,
/// read-back, wall, bunny, one-process, items, before, first-minute; `ahead`: bunny, city, city-large, osg, read-back,
/// first, before, first-minute. `--frames N`, `--each 1` (a line for each frame and tile), `--plant FOLDER`, `--scan
/// FILE`,
/// `--before FOLDER` (the programs of another build, for `before`), `--json FILE`.
#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <optional>

#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"
#include "tests/bench/SceneTable.h"
#include "tests/bench/SideProcess.h"
#include "tests/bench/WallRow.h"

namespace tessera::bench {
namespace {

struct DrawingOptions {
    std::string json, rows, program;
    std::string plant, scan, before;
    int frames = 12;
    bool each = false;
};

/// What the drawing of today is to be ahead of.
constexpr const char* kAheadRows = "bunny,city,city-large,osg,read-back,first,before,first-minute";

double meanOf(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) /
           static_cast<double>(std::max<std::size_t>(1, values.size()));
}
Median plain(double value) {
    return {.value = value, .spread = 0, .count = 1};
}

double wallMs() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double shareOf(std::uint64_t part, std::uint64_t whole) {
    return static_cast<double>(part) / static_cast<double>(std::max<std::uint64_t>(1, whole));
}

void cullRows(SceneTable& table, Stage stage, const DrawingOptions& options, double atMost, double aim, double worst) {
    table.begin(stage.name);
    const CullCost cost = measureCulling(stage, CullerKind::kAuto, CullerKind::kFrustum, true, options.each);
    const std::string remark = fmt::format(
        "per tile {:.0f} in the frustum, {:.0f} drawn, {:.0f} visible; triangles {:.3f} of the frustum's, the "
        "oracle's {:.3f}; culling {:.1f} ms; {} tiles of the oracle's differ",
        cost.inFrustum, cost.drawn, cost.visible, shareOf(cost.triangles, cost.allTriangles),
        shareOf(cost.oracleTriangles, cost.allTriangles), cost.cullMs, cost.oracleWrong);
    // Means: what a long way costs. A frame in which much comes into sight counts as it is.
    table.add({.operation = stage.name + ": a frame by auto",
               .peer = "oracle: what has a visible pixel",
               .ours = plain(meanOf(cost.ours)),
               .theirs = plain(meanOf(cost.oracle)),
               .unit = "ms",
               .atMost = atMost,
               .aim = aim,
               .remark = remark});
    table.add({.operation = stage.name + ": a frame by auto",
               .peer = "frustum only",
               .ours = plain(meanOf(cost.ours)),
               .theirs = plain(meanOf(cost.all)),
               .unit = "ms"});
    if (worst <= 0) return;
    table.add({.operation = stage.name + ": the worst frame",
               .peer = "the median one",
               .ours = plain(*std::max_element(cost.ours.begin(), cost.ours.end())),
               .theirs = medianOf(cost.ours),
               .unit = "ms",
               .atMost = worst});
}

/// Beside another culler alone.
void besideRow(SceneTable& table, Stage stage, const DrawingOptions& options, CullerKind other, const std::string& peer,
               double atMost) {
    table.begin(stage.name);
    const CullCost cost = measureCulling(stage, CullerKind::kAuto, other, false, options.each);
    table.add({.operation = stage.name + ": a frame by auto",
               .peer = peer,
               .ours = plain(meanOf(cost.ours)),
               .theirs = plain(meanOf(cost.all)),
               .unit = "ms",
               .atMost = atMost,
               .remark = fmt::format("{} of {} triangles given to GL; culling {:.1f} ms", cost.triangles,
                                     cost.allTriangles, cost.cullMs)});
}

/// A tile of 960x540, and its way out, beside a copy of as many bytes.
void tileRow(SceneTable& table, const std::string& name, const Aspect& aspect, int samples, const std::string& remark) {
    RenderScene scene;
    scene.update(aspect, nullptr);
    const auto surface = orExit(makeSurface("osmesa"));
    const auto renderer = orExit(Renderer::create(*surface, {.samples = samples}));
    RenderAction action(CullerKind::kAuto);
    const ScreenCamera camera = screenCamera(benchScreen(), User(), Eye::kCenter, View());
    const PixelRect rect{.x = 0, .y = 0, .width = 960, .height = 540};
    const std::vector<std::uint8_t> from(4u * 960 * 540, 7);
    std::vector<std::uint8_t> to(from.size());
    std::vector<double> ours, copies;
    for (int i = 0; i < 60; ++i) {
        double start = processorMs();
        static_cast<void>(orExit(renderer->draw(aspect, action.run(scene, camera, rect, nullptr), camera, rect)));
        if (i >= 10) ours.push_back(processorMs() - start);
        start = processorMs();
        std::memcpy(to.data(), from.data() + (to[static_cast<std::size_t>(i)] & 0), to.size());
        if (i >= 10) copies.push_back(processorMs() - start);
    }
    table.add({.operation = name + (samples == 1 ? ", one sample" : ", 4 samples"),
               .peer = "a copy of its pixels",
               .ours = medianOf(ours),
               .theirs = medianOf(copies),
               .unit = "ms",
               .remark = "processor time" + remark});
}

/// One that shows nothing, and one full of a single face.
void emptyRows(SceneTable& table) {
    table.begin("a tile of 960x540");
    tileRow(table, "an empty tile", Aspect(), 4, "; 45 ms when the limit of half was set, on another machine");
    City city;
    city.meshes = {makeBox({1, 1, 1})};
    city.places = {{0, {0, 1.5, -3}, {40, 40, 1}}};
    const Stage stage = cityStage("one face", city, 1);
    for (const int samples : {1, 4}) tileRow(table, "full of one face", stage.aspect, samples, "");
}

/// From a program's start to the pixels of its first lit frame: this program, started with --first.
int firstFrame() {
    const auto surface = orExit(makeSurface("osmesa"));
    const auto renderer = orExit(Renderer::create(*surface, {.samples = 4}));
    City city;
    city.meshes = {makeBox({1, 1, 1})};
    city.places = {{0, {0, 1.5, -3}, {1, 1, 1}}};
    Stage stage = cityStage("one box", city, 1);
    RenderScene scene;
    scene.update(stage.aspect, nullptr);
    const ScreenCamera camera = screenCamera(benchScreen(), User(), Eye::kCenter, View());
    const PixelRect rect{.x = 0, .y = 0, .width = 960, .height = 540};
    RenderAction action(CullerKind::kAuto);
    static_cast<void>(orExit(renderer->draw(stage.aspect, action.run(scene, camera, rect, nullptr), camera, rect)));
    std::printf("0\n");
    std::fflush(stdout);
    // Surfaces are torn down outside of the time that is taken.
    return std::getchar() == EOF ? 0 : 0;
}

void firstRows(SceneTable& table, const DrawingOptions& options) {
    table.begin("first frame");
    std::vector<double> taken;
    for (int i = 0; i < 7; ++i) {
        const double start = wallMs();
        SideProcess first({options.program, "--first"});
        static_cast<void>(first.ask("", 1));
        if (i > 0) taken.push_back(wallMs() - start);
    }
    table.add({.operation = "from a process' start to its first lit frame of 960x540",
               .peer = "60 ms",
               .ours = medianOf(taken),
               .theirs = plain(60),
               .unit = "ms",
               .atMost = 1,
               .aim = 40.0 / 60,
               .remark = "wall time, caches warm"});
}

/// 1920×1080 in one process on all cores, 4 samples, beside OpenSceneGraph in a window of the same size; wall time, in
/// turns.
void osgRows(SceneTable& table, const DrawingOptions& options) {
    table.begin("city beside OpenSceneGraph");
    const std::string peer = std::filesystem::path(options.program).parent_path() / "bench_drawing_osg";
    if (!std::filesystem::exists(peer) || std::system("command -v xvfb-run >/dev/null 2>&1") != 0) {
        table.skip("OpenSceneGraph or xvfb-run was not found; ./deploy/set-up --peers installs them");
        return;
    }
    Stage stage = cityStage("city", makeCity(), options.frames);
    RenderScene scene;
    scene.update(stage.aspect, nullptr);
    const auto surface = orExit(makeSurface("osmesa"));
    const auto renderer = orExit(Renderer::create(*surface, {.samples = 4}));
    RenderAction action(CullerKind::kAuto);
    const PixelRect rect{.x = 0, .y = 0, .width = 1920, .height = 1080};
    const auto ours = [&](const View& view) {
        const double start = wallMs();
        const ScreenCamera camera = screenCamera(benchScreen(), User(), Eye::kCenter, view);
        static_cast<void>(orExit(renderer->draw(stage.aspect, action.run(scene, camera, rect, nullptr), camera, rect)));
        return wallMs() - start;
    };
    struct Way {
        std::string name;
        double atMost, aim;
    };
    const std::array<Way, 2> ways = {{{"default", 0.15, 0.1}, {"queries", 0.25, 0.125}}};
    for (const auto& [way, atMost, aim] : ways) {
        SideProcess theirs({"/usr/bin/env", "xvfb-run", "-a", "-s", "-screen 0 1920x1080x24", peer, way,
                            std::to_string(options.frames)});
        if (!theirs.said("ready")) {
            table.skip("OpenSceneGraph has no window of 1920x1080 with 4 samples under Xvfb");
            return;
        }
        for (int i = 0; i < 3; ++i) static_cast<void>(ours(stage.views.front()));
        std::vector<double> our, their;
        for (int i = 0; i < options.frames; ++i) {
            our.push_back(ours(stage.views[static_cast<std::size_t>(i)]));
            their.push_back(theirs.ask(fmt::format("frame {}", i), 1)[0]);
        }
        table.add({.operation = "city, 1920x1080, a frame",
                   .peer = way == "default" ? "OpenSceneGraph" : "its OcclusionQueryNode",
                   .ours = plain(meanOf(our)),
                   .theirs = plain(meanOf(their)),
                   .unit = "ms",
                   .atMost = atMost,
                   .aim = aim});
    }
}

int bench(int argc, char** argv) {
    DrawingOptions options;
    options.program = std::filesystem::read_symlink("/proc/self/exe");
    const char* named = std::getenv("TESSERA_TEST_DATA");
    const std::string data = named ? named : TESSERA_SOURCE_DIR "/../shared/data";
    options.plant = data + "/plant";
    options.scan = data + "/scan/stanford_bun_zipper.ply";
    if (argc > 1 && std::strcmp(argv[1], "--first") == 0) return firstFrame();
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string option = argv[i];
        if (option == "--json")
            options.json = argv[i + 1];
        else if (option == "--rows")
            options.rows = argv[i + 1];
        else if (option == "--plant")
            options.plant = argv[i + 1];
        else if (option == "--scan")
            options.scan = argv[i + 1];
        else if (option == "--before")
            options.before = argv[i + 1];
        else if (option == "--each")
            options.each = std::atoi(argv[i + 1]) != 0;
        else if (option == "--frames")
            options.frames = std::max(1, std::atoi(argv[i + 1]));
        else {
            std::fprintf(stderr, "bench_drawing: unknown option %s\n", argv[i]);
            return 2;
        }
    }
    if (options.rows == "ahead") options.rows = kAheadRows;
    std::signal(SIGPIPE, SIG_IGN);
    SceneTable table;
    const auto wanted = [&](const std::string& group) {
        return options.rows.empty() || ("," + options.rows + ",").find("," + group + ",") != std::string::npos;
    };
    const auto orSkip = [&](Expected<Stage> stage, const auto& then) {
        if (stage)
            then(std::move(*stage));
        else
            table.skip(stage.error().message);
    };
    if (wanted("city"))
        cullRows(table, cityStage("city, 5.9 M triangles", makeCity(), options.frames), options, 1.1, 1.05, 0);
    if (wanted("city-large"))
        cullRows(table, cityStage("city, 22.9 M triangles", makeCity(32, 31), options.frames), options, 1.1, 1.05, 0);
    if (wanted("plant"))
        orSkip(plantStage(options.plant, options.frames),
               [&](Stage stage) { cullRows(table, std::move(stage), options, 1.3, 0, 3); });
    if (wanted("scan"))
        orSkip(scanStage(options.scan, options.frames), [&](Stage stage) {
            besideRow(table, std::move(stage), options, CullerKind::kNone, "drawing all", 1 / 1.5);
        });
    if (wanted("field"))
        besideRow(table, fieldStage(4 * options.frames), options, CullerKind::kFrustum, "frustum only", 1.02);
    if (wanted("points")) pointRows(table, options.frames);
    if (wanted("glyphs")) glyphRows(table, options.frames);
    if (wanted("empty")) emptyRows(table);
    if (wanted("first")) firstRows(table, options);
    if (wanted("shadows")) shadowRows(table, 10 * options.frames);
    if (wanted("wall")) wallRows(table, options.program, 4 * options.frames, 3);
    if (wanted("osg")) osgRows(table, options);
    if (wanted("read-back")) readBackRows(table);
    if (wanted("bunny")) bunnyWallRows(table, options.scan, std::filesystem::path(options.program).parent_path());
    if (wanted("items")) itemRows(table);
    if (wanted("one-process")) oneProcessRows(table);
    if (wanted("before")) wallBeforeRows(table, options.program, options.before, 4 * options.frames, 5);
    if (wanted("first-minute")) firstMinuteRows(table, 5);
    table.summarise();
    if (!options.json.empty() && !table.writeJson(options.json)) {
        std::fprintf(stderr, "bench_drawing: cannot write %s\n", options.json.c_str());
        return 1;
    }
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench(argc, argv);
}
