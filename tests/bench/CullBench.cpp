/// What each culler saves, and what it costs: whole frames (cull + draw) against frustum culling only, and
/// against an oracle that knows for free which items leave a pixel, in the same run, in turns. A 2×2 wall of 960×540
/// tiles.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>

#include "client/draw/Renderer.h"
#include "client/render/RenderAction.h"
#include "common/geometry/Mesh.h"
#include "common/geometry/TriangleOrder.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "server/import/Importer.h"

namespace tessera {
namespace {

/// Processor time of all threads: what stays comparable when others use the machine, and what counts where each core has a
/// tile of its own.
double processorMs() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

template <typename T>
T orExit(Expected<T> value) {
    if (value) return std::move(*value);
    std::fprintf(stderr, "bench_cull: %s\n", value.error().message.c_str());
    std::exit(exitCode(value.error().code));
}

struct Stage {
    std::string name;
    Aspect aspect;
    std::vector<View> views;  ///< one per frame
};

Screen benchScreen() {
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 2.4, 0};
    screen.grid.columns = 2;
    screen.grid.rows = 2;
    return screen;
}

struct Row {
    std::string name, peer;
    double ours, theirs;
    std::string unit;
};

/// Things at places, without a hierarchy.
class SceneWriter {
public:
    ObjectId geometry(const MeshData& mesh) {
        const ObjectId id{next_++};
        const MeshArrays arrays = mesh.toArrays();
        list_.create(id, typeOf<Geometry>());
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, toValue(arrays.positions));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::normals>, toValue(arrays.normals));
        list_.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, toValue(arrays.indices));
        return id;
    }
    void put(ObjectId core, const Vec3d& at, const Vec3d& size) {
        const ObjectId place{next_++}, outer{next_++}, inner{next_++};
        list_.create(place, typeOf<Transform>());
        list_.set(place, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(at));
        list_.set(place, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(size));
        list_.create(outer, typeOf<Node>());
        list_.set(outer, typeOf<Node>(), fieldId<&Node::core>, toValue(place));
        list_.place(outer, kRootNode);
        list_.create(inner, typeOf<Node>());
        list_.set(inner, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        list_.place(inner, outer);
    }
    Stage stage(std::string name) {
        Stage made;
        made.name = std::move(name);
        orExit(made.aspect.apply(list_.take()).map([] { return 0; }));
        return made;
    }

private:
    ChangeListBuilder list_;
    std::uint64_t next_ = 2;
};

/// 576 houses that are boxes, 20 things of 512 triangles around each: 12,096 items.
Stage makeCity(int frames) {
    std::mt19937 random(1);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    SceneWriter scene;
    const ObjectId house = scene.geometry(makeBox({1, 1, 1}));
    const ObjectId thing = scene.geometry(makeTorus(0.7, 0.3, 16, 16));
    for (int x = -12; x < 12; ++x) {
        for (int z = -12; z < 12; ++z) {
            const Vec3d corner(24.0 * x + 12, 0, 24.0 * z + 12);
            const double height = uniform(8, 40);
            scene.put(house, corner + Vec3d(0, height / 2, 0), {16, height, 16});
            for (int i = 0; i < 20; ++i) {
                const double along = uniform(-11, 11);
                const double off = (random() % 2 ? 1 : -1) * uniform(9, 11);
                scene.put(thing, corner + (i % 2 ? Vec3d(along, uniform(0.3, 5), off) : Vec3d(off, uniform(0.3, 5), along)),
                    Vec3d::Constant(uniform(0.3, 1)));
            }
        }
    }
    Stage stage = scene.stage("city");
    for (int i = 0; i < frames; ++i) {
        View view;
        // Down a street, looking about: now and then twenty frames as they come at 15 m/s, so that one in twenty is a new sight.
        const double t = static_cast<double>(i / 20 * 20) / frames;
        const double metres = 300 * t + 0.25 * (i % 20);
        view.position = {0, 0.5, 200 - metres};
        view.orientation = Quatd(Eigen::AngleAxisd(0.5 * std::sin(metres / 50), Vec3d::UnitY()));
        stage.views.push_back(view);
    }
    return stage;
}

/// A field: 8,000 things on the ground, nothing before another one but by chance.
Stage makeField(int frames) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> anywhere(-60, 60);
    SceneWriter scene;
    const ObjectId thing = scene.geometry(makeTorus(0.7, 0.3, 12, 10));
    for (int i = 0; i < 8'000; ++i) scene.put(thing, {anywhere(random), 0.2, anywhere(random)}, Vec3d::Constant(0.25));
    Stage stage = scene.stage("open field");
    for (int i = 0; i < frames; ++i) {
        View view;
        view.position = {0, 9, 60.0 - 40.0 * i / frames};
        view.orientation = Quatd(Eigen::AngleAxisd(-0.35, Vec3d::UnitX()));
        stage.views.push_back(view);
    }
    return stage;
}

/// One mesh of 864,000 triangles, a ring that the camera goes along near its surface.
Stage makeRing(int frames) {
    MeshData mesh = makeTorus(3, 1, 1200, 360);
    mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
    SceneWriter scene;
    scene.put(scene.geometry(mesh), Vec3d::Zero(), Vec3d::Ones());
    Stage stage = scene.stage("ring of 864,000 triangles, close up");
    for (int i = 0; i < frames; ++i) {
        View view;
        const double angle = 6.28 * i / frames;
        view.orientation = Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitY()));
        view.position = view.orientation * Vec3d(4.6, -1, 1.5);
        view.worldUnitsPerMetre = 0.5;
        stage.views.push_back(view);
    }
    return stage;
}

/// In parts beside as a whole.
void measureParts(Stage& stage, Renderer& renderer, std::vector<Row>& rows) {
    const Screen screen = benchScreen();
    const User user;
    RenderScene all;
    all.update(stage.aspect, nullptr);
    const int width = screen.grid.tileWidthPx, height = screen.grid.tileHeightPx;
    RenderAction masked(CullerKind::kMasked), none(CullerKind::kNone);
    double inParts = 0, whole = 0;
    std::uint64_t some = 0, every = 0;
    const auto draw = [&](RenderAction& action, const View& view, const PixelRect& rect, double& ms,
                          std::uint64_t& triangles) {
        const ScreenCamera camera = screenCamera(screen, user, Eye::kCenter, view);
        const double start = processorMs();
        static_cast<void>(
            orExit(renderer.draw(stage.aspect, action.run(all, camera, rect, nullptr), camera, rect)));
        ms += processorMs() - start;
        triangles += renderer.lastCounts().triangles;
    };
    double ignored = 0;
    std::uint64_t uncounted = 0;
    draw(none, stage.views.front(), {0, 0, width, height}, ignored, uncounted);
    for (const View& view : stage.views)
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{tile % 2 * width, tile / 2 * height, width, height};
            draw(masked, view, rect, inParts, some);
            draw(none, view, rect, whole, every);
        }
    const double tiles = 4.0 * static_cast<double>(stage.views.size());
    std::printf("%s: per tile %.0f of %.0f triangles given to GL, in all cells\n", stage.name.c_str(),
                static_cast<double>(some) / tiles, static_cast<double>(every) / tiles);
    rows.push_back({stage.name, "drawing all", inParts / tiles, whole / tiles, "ms"});
}

/// The scene file, seen from its first enabled camera, which turns about.
Stage loadScene(const std::string& name, const std::string& path, const std::vector<std::string>& assets, int frames) {
    const ImportedScene imported = orExit(importScene(
        path, kRootNode,
        {.assetFolders = assets, .allowUnconfined = true, .importerProgram = TESSERA_BIN_DIR "/tessera-import"}));
    ChangeList list = imported.list;
    replaceIds(list, [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 2} : id; });
    Stage stage;
    stage.name = name;
    orExit(stage.aspect.apply(list).map([] { return 0; }));
    View first;
    bool found = false;
    Action search;
    search.on<Camera>([&](const Visit& visit, const Camera& camera) {
        if (!found && camera.enabled != 0) {
            found = true;
            first.position = visit.world_T_node.translation();
            first.orientation = Quatd(visit.world_T_node.rotation());
            first.worldUnitsPerMetre = camera.worldUnitsPerMetre;
        }
        return Descend::kInto;
    });
    search.run(stage.aspect);
    if (!found) {
        std::fprintf(stderr, "bench_cull: %s has no camera\n", path.c_str());
        std::exit(3);
    }
    for (int i = 0; i < frames; ++i) {
        View view = first;
        const double angle = 0.8 * std::sin(6.28 * i / frames);
        view.orientation = first.orientation * Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitY()));
        stage.views.push_back(view);
    }
    return stage;
}

struct Totals {
    double cullMs = 0, drawMs = 0;
    std::uint64_t inFrustum = 0, drawn = 0, triangles = 0, queries = 0, waits = 0, depthTriangles = 0;
    [[nodiscard]] double frameMs() const { return cullMs + drawMs; }
};

void measure(Stage& stage, Renderer& renderer, std::vector<Row>& rows) {
    const Screen screen = benchScreen();
    const User user;
    RenderScene all;
    all.update(stage.aspect, nullptr);
    const int width = screen.grid.tileWidthPx;
    const int height = screen.grid.tileHeightPx;
    // Meshes are uploaded and made ready for hiding before anything counts.
    const ScreenCamera start = screenCamera(screen, user, Eye::kCenter, stage.views.front());
    RenderAction none(CullerKind::kNone);
    static_cast<void>(orExit(renderer.draw(stage.aspect, none.run(all, start, {0, 0, width, height}, nullptr), start,
                                           {0, 0, width, height})));

    std::vector<CullerKind> kinds(kAllCullers.begin(), kAllCullers.end());
    std::erase(kinds, CullerKind::kNone);
    // One per tile, as hosts have them: they remember what was hidden, and whether looking for it paid.
    std::map<std::pair<CullerKind, int>, RenderAction> actions;
    for (const CullerKind kind : kinds)
        for (int tile = 0; tile < 4; ++tile) actions.try_emplace({kind, tile}, kind);
    std::map<CullerKind, Totals> totals;
    Totals byOracle;
    double tiles = 0;
    for (const View& view : stage.views) {
        const ScreenCamera camera = screenCamera(screen, user, Eye::kCenter, view);
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{tile % 2 * width, tile / 2 * height, width, height};
            ++tiles;
            DrawList inFrustum;
            for (const CullerKind kind : kinds) {
                Totals& total = totals[kind];
                CullCounts counts;
                const double start1 = processorMs();
                DrawList list =
                    orExit(actions.at({kind, tile}).run(all, camera, rect, &renderer.visibility(stage.aspect), &counts));
                total.cullMs += processorMs() - start1;
                const double start2 = processorMs();
                static_cast<void>(orExit(renderer.draw(stage.aspect, list, camera, rect)));
                total.drawMs += processorMs() - start2;
                total.inFrustum += counts.inFrustum;
                total.drawn += counts.drawn;
                total.triangles += counts.trianglesDrawn;
                total.queries += counts.queries;
                total.waits += counts.waits;
                total.depthTriangles += counts.depthTriangles;
                if (kind == CullerKind::kFrustum) inFrustum = std::move(list);
            }
            const auto ids = orExit(renderer.drawNodeIds(stage.aspect, inFrustum, camera, rect));
            const std::set<std::uint64_t> visible(ids.begin(), ids.end());
            std::erase_if(inFrustum.opaque, [&](const DrawItem& item) { return !visible.contains(item.node.value); });
            std::erase_if(inFrustum.transparent, [&](const DrawItem& item) { return !visible.contains(item.node.value); });
            const double start3 = processorMs();
            static_cast<void>(orExit(renderer.draw(stage.aspect, inFrustum, camera, rect)));
            byOracle.drawMs += processorMs() - start3;
            byOracle.drawn += inFrustum.opaque.size() + inFrustum.transparent.size();
        }
    }
    const Totals& byFrustum = totals.at(CullerKind::kFrustum);
    const auto perTile = [&](auto value) { return static_cast<double>(value) / tiles; };
    std::printf("%s: per tile %.0f in the frustum, %.0f visible; drawn by the oracle in %.2f ms\n", stage.name.c_str(),
                perTile(byFrustum.inFrustum), perTile(byOracle.drawn), byOracle.drawMs / tiles);
    std::printf("  %-13s %8s %8s %9s %8s %6s %9s %9s   per tile, ms of processor time\n", "culler", "drawn", "triang.",
                "queries", "waits", "depth", "cull", "draw");
    for (const auto& [kind, total] : totals)
        std::printf("  %-13s %8.0f %8.0f %9.1f %8.1f %6.0f %9.2f %9.2f\n", std::string(nameOf(kind)).c_str(),
                    perTile(total.drawn), perTile(total.triangles), perTile(total.queries), perTile(total.waits),
                    perTile(total.depthTriangles), total.cullMs / tiles, total.drawMs / tiles);
    std::fflush(stdout);
    const auto share = [](std::uint64_t part, std::uint64_t whole) {
        return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
    };
    for (const auto& [kind, total] : totals) {
        if (kind == CullerKind::kFrustum) continue;
        const std::string name = fmt::format("{}: tile by {}", stage.name, nameOf(kind));
        rows.push_back({name, "frustum only", total.frameMs() / tiles, byFrustum.frameMs() / tiles, "ms"});
        rows.push_back({name, "oracle", total.frameMs() / tiles, byOracle.drawMs / tiles, "ms"});
        rows.push_back({fmt::format("{}: share left away by {}", stage.name, nameOf(kind)), "what is invisible",
                        1 - share(total.drawn, total.inFrustum), 1 - share(byOracle.drawn, total.inFrustum), "of the frustum"});
    }
    const Totals& coherent = totals.at(CullerKind::kQueries);
    const Totals& waiting = totals.at(CullerKind::kQueriesWait);
    rows.push_back({stage.name + ": cull by queries", "queries-wait", coherent.cullMs / tiles, waiting.cullMs / tiles, "ms"});
    rows.push_back({stage.name + ": tile by queries", "queries-wait", coherent.frameMs() / tiles, waiting.frameMs() / tiles, "ms"});
}

int bench(int argc, char** argv) {
    std::string json;
    std::string hall = TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct";
    std::vector<std::string> assets{"/usr/share/assimp/models/glTF2", "/usr/share/assimp/models"};
    std::string only;
    int frames = 8;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string option = argv[i];
        if (option == "--json") json = argv[i + 1];
        if (option == "--hall") hall = argv[i + 1];
        if (option == "--assets") assets.insert(assets.begin(), argv[i + 1]);
        if (option == "--only") only = argv[i + 1];
        if (option == "--frames") frames = std::max(1, std::atoi(argv[i + 1]));
    }
    const auto surface = orExit(makeSurface("osmesa"));
    std::vector<Row> rows;
    const std::array<std::pair<std::string, std::function<Stage()>>, 3> stages{
        {{"city", [&] { return makeCity(5 * frames); }},
         {"hall", [&] { return loadScene("engine hall", hall, assets, frames); }},
         {"field", [&] { return makeField(5 * frames); }}}};
    for (const auto& [name, make] : stages) {
        if (!only.empty() && only != name) continue;
        const auto renderer = orExit(Renderer::create(*surface, {.samples = 4}));
        Stage stage = make();
        measure(stage, *renderer, rows);
    }
    if (only.empty() || only == "ring") {
        const auto renderer = orExit(Renderer::create(*surface, {.samples = 4}));
        Stage ring = makeRing(frames);
        measureParts(ring, *renderer, rows);
    }
    std::printf("\n%-36s %-24s %10s %10s %8s\n", "case", "peer", "ours", "theirs", "ratio");
    std::string cases;
    for (const Row& row : rows) {
        const double ratio = row.theirs > 0 ? row.ours / row.theirs : 0;
        std::printf("%-36s %-24s %10.3f %10.3f %8.3f  %s\n", row.name.c_str(), row.peer.c_str(), row.ours, row.theirs,
                    ratio, row.unit.c_str());
        cases +=
            fmt::format(R"({}{{"case":"{}","peer":"{}","ours":{:.17g},"theirs":{:.17g},"unit":"{}","ratio":{:.17g}}})",
                        cases.empty() ? "\n" : ",\n", row.name, row.peer, row.ours, row.theirs, row.unit, ratio);
    }
    if (!json.empty()) std::ofstream(json) << "{\"cases\":[" << cases << "\n]}\n";
    return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::bench(argc, argv);
}
