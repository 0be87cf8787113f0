/// What each culler saves, and what it costs: whole frames (cull + draw) against frustum culling only, and
/// against an oracle that knows for free which items leave a pixel, in the same run, in turns. A 2×2 wall of 960×540
/// tiles.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "tests/bench/DrawingStage.h"
#include "tests/bench/FileStage.h"
#include "tests/bench/VisibleItems.h"

namespace tessera::bench {
namespace {

constexpr int kSamples = 4;

struct Row {
    std::string name, peer;
    double ours, theirs;
    std::string unit;
};

/// Down a street, looking about: now and then twenty frames as they come at 15 m/s, so that one in twenty is a new
/// sight.
Stage makeStreet(int frames) {
    Stage stage = cityStage("city", makeCity(), 0);
    for (int i = 0; i < frames; ++i) {
        View view;
        const double t = static_cast<double>(i / 20 * 20) / frames;
        const double metres = 300 * t + 0.25 * (i % 20);
        view.position = {0, 0.5, 200 - metres};
        view.orientation = Quatd(Eigen::AngleAxisd(0.5 * std::sin(metres / 50), Vec3d::UnitY()));
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
                    orExit(actions.at({kind, tile}).run(all, camera, rect, &renderer.visibility(), &counts));
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
            inFrustum = visibleItems(renderer, stage.aspect, std::move(inFrustum), camera, rect, kSamples);
            static_cast<void>(orExit(
                renderer.draw(stage.aspect, inFrustum, camera, rect)));  // brings the buffers back to a tile's size
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
                        1 - share(total.drawn, total.inFrustum), 1 - share(byOracle.drawn, total.inFrustum),
                        "of the frustum"});
    }
    const Totals& coherent = totals.at(CullerKind::kQueries);
    const Totals& waiting = totals.at(CullerKind::kQueriesWait);
    rows.push_back(
        {stage.name + ": cull by queries", "queries-wait", coherent.cullMs / tiles, waiting.cullMs / tiles, "ms"});
    rows.push_back({stage.name + ": tile by queries", "queries-wait", coherent.frameMs() / tiles,
                    waiting.frameMs() / tiles, "ms"});
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
        {{"city", [&] { return makeStreet(5 * frames); }},
         {"hall", [&] { return fileStage("engine hall", hall, assets, frames); }},
         {"field", [&] { return fieldStage(5 * frames); }}}};
    for (const auto& [name, make] : stages) {
        if (!only.empty() && only != name) continue;
        const auto renderer = orExit(Renderer::create(*surface, {.samples = kSamples}));
        Stage stage = make();
        measure(stage, *renderer, rows);
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
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench(argc, argv);
}
