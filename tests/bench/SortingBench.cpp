/// The sortings (client/render/order/DrawSorting.h) beside each other: what drawing costs, scene by scene, in turns in
/// the same run. Four tiles of 960×540, what `auto` leaves to be drawn.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "tests/bench/FileStage.h"
#include "tests/golden/TestScene.h"

namespace tessera::bench {
namespace {

using test::TestScene;

Stage cityOf(int frames) {
    return cityStage("city", makeCity(), frames);
}

void walkOver(Stage& stage, int frames) {
    for (int i = 0; i < frames; ++i) {
        View view;
        view.position = {6 * std::sin(6.28 * i / frames), 1, 8.0 - i % 5};
        view.orientation = Quatd(Eigen::AngleAxisd(0.4 * std::sin(12.6 * i / frames), Vec3d::UnitY()));
        stage.views.push_back(view);
    }
}

/// 4,000 things of eight shapes, any of 96 materials: of eight sets of images, cut out, seen from both sides.
Stage manyMaterials(int frames) {
    std::mt19937 random(5);
    const auto any = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
    TestScene scene;
    const auto image = [&] {
        std::vector<std::uint8_t> pixels;
        for (int i = 0; i < 64 * 64; ++i)
            for (int c = 0; c < 4; ++c)
                pixels.push_back(static_cast<std::uint8_t>(c == 3 && i % 7 ? 255 : 96 + random() % 160));
        return scene.add(
            Image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = 64, .heightPx = 64});
    };
    std::vector<ObjectId> shapes;
    for (int i = 0; i < 96; ++i) {
        Material material;
        material.baseColor = Vec4f(static_cast<float>(any(0.2, 1)), static_cast<float>(any(0.2, 1)), 0.5f, 1);
        material.roughness = static_cast<float>(any(0.1, 1));
        material.alphaMode = i % 8 == 7 ? Material::kMask : Material::kOpaque;
        material.doubleSided = i % 5 == 0;
        if (i % 2) material.baseColorImage = image();
        if (i % 4 == 2) material.metallicRoughnessImage = image();
        if (i % 8 == 3) material.normalImage = image();
        const ObjectId made = scene.add(material);
        MeshData shape = i % 4 == 0   ? makeBox({1, 1, 1})
                         : i % 4 == 1 ? makeSphere(0.6, 12)
                         : i % 4 == 2 ? makeTorus(0.5, 0.2, 16, 8)
                                      : makeCylinder(0.4, 1, 16);
        if (shape.texcoords.empty())
            for (std::size_t k = 0; k < shape.positions.size(); k += 3)
                shape.texcoords.insert(shape.texcoords.end(),
                                       {shape.positions[k] + shape.positions[k + 2], shape.positions[k + 1]});
        shapes.push_back(scene.add(shape, made));
    }
    for (int i = 0; i < 4000; ++i)
        scene.place(shapes[random() % shapes.size()], {any(-30, 30), any(-2, 4), any(-60, -2)},
                    Quatd(any(0.1, 1), any(-1, 1), any(-1, 1), any(-1, 1)), Vec3d::Constant(any(0.3, 1)));
    Stage stage{.name = "many materials", .aspect = scene.take(), .views = {}};
    walkOver(stage, frames);
    return stage;
}

/// 10,000 nodes of one core.
Stage crowd(const std::string& name, const MeshData& mesh, int frames) {
    std::mt19937 random(6);
    const auto any = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
    TestScene scene;
    const ObjectId core = scene.add(mesh);
    for (int i = 0; i < 10'000; ++i)
        scene.place(core, {any(-40, 40), any(-1, 0), any(-80, -2)}, Quatd(Eigen::AngleAxisd(any(0, 6), Vec3d::UnitY())),
                    Vec3d::Constant(any(0.2, 0.5)));
    Stage stage{.name = name, .aspect = scene.take(), .views = {}};
    walkOver(stage, frames);
    return stage;
}

struct Totals {
    double ms = 0;
    std::uint64_t calls = 0, states = 0, items = 0;
};

using Milliseconds = double (*)();

double wallMs() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void measure(Stage& stage, Surface& surface, int samples, CullerKind culler, Milliseconds clock, std::string& cases) {
    const auto renderer = orExit(Renderer::create(surface, {.samples = samples}));
    const Screen screen = benchScreen();
    RenderScene scene;
    scene.update(stage.aspect, nullptr);
    const int width = screen.grid.tileWidthPx, height = screen.grid.tileHeightPx;
    std::map<std::pair<DrawSorting, int>, RenderAction> actions;
    for (const DrawSorting sorting : kAllDrawSortings)
        for (int tile = 0; tile < 4; ++tile) actions.try_emplace({sorting, tile}, culler, sorting);
    std::map<DrawSorting, Totals> totals;
    for (std::size_t frame = 0; frame < stage.views.size() + 1; ++frame) {
        // The first one uploads and compiles.
        const View& view = stage.views[frame == 0 ? 0 : frame - 1];
        const ScreenCamera camera = screenCamera(screen, User(), Eye::kCenter, view);
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{tile % 2 * width, tile / 2 * height, width, height};
            for (std::size_t k = 0; k < kAllDrawSortings.size(); ++k) {
                const DrawSorting sorting = kAllDrawSortings[(k + frame) % kAllDrawSortings.size()];
                const DrawList list = actions.at({sorting, tile}).run(scene, camera, rect, nullptr);
                const double start = clock();
                static_cast<void>(orExit(renderer->draw(stage.aspect, list, camera, rect)));
                if (frame == 0) continue;
                Totals& total = totals[sorting];
                total.ms += clock() - start;
                total.calls += renderer->lastCounts().glCalls;
                total.states += renderer->lastCounts().states;
                total.items += list.opaque.size();
            }
        }
    }
    const double tiles = 4.0 * static_cast<double>(stage.views.size());
    const double byDepth = totals[DrawSorting::kDepth].ms;
    for (const auto& [sorting, total] : totals) {
        std::printf("%-24s %8d %7.0f  %-6s %9.0f %9.0f %9.2f %7.3f\n", stage.name.c_str(), samples,
                    static_cast<double>(total.items) / tiles, std::string(nameOf(sorting)).c_str(),
                    static_cast<double>(total.calls) / tiles, static_cast<double>(total.states) / tiles,
                    total.ms / tiles, total.ms / byDepth);
        cases +=
            fmt::format(R"({}{{"case":"{}, {} samples: {}","peer":"depth","ours":{:.17g},"theirs":{:.17g},"unit":"ms",)"
                        R"("ratio":{:.17g}}})",
                        cases.empty() ? "\n" : ",\n", stage.name, samples, nameOf(sorting), total.ms / tiles,
                        byDepth / tiles, total.ms / byDepth);
    }
    std::fflush(stdout);
}

int bench(int argc, char** argv) {
    std::string json, only, culler = "auto", surfaceName = "osmesa";
    std::string hall = TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct";
    int frames = 10;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string option = argv[i];
        if (option == "--json") json = argv[i + 1];
        if (option == "--hall") hall = argv[i + 1];
        if (option == "--only") only = argv[i + 1];
        if (option == "--culler") culler = argv[i + 1];
        if (option == "--surface") surfaceName = argv[i + 1];
        if (option == "--frames") frames = std::max(1, std::atoi(argv[i + 1]));
    }
    const auto kind =
        std::find_if(kAllCullers.begin(), kAllCullers.end(), [&](CullerKind k) { return nameOf(k) == culler; });
    if (kind == kAllCullers.end() || asksRenderer(*kind)) {
        std::fprintf(stderr, "bench_sorting: no culler '%s' that works by itself\n", culler.c_str());
        return 2;
    }
    const auto surface = orExit(makeSurface(surfaceName));
    // A GPU's time is not the processor's; reading back waits for it.
    const Milliseconds clock = surfaceName == "osmesa" ? processorMs : wallMs;
    const std::vector<std::string> assets{"/usr/share/assimp/models/glTF2", "/usr/share/assimp/models"};
    const std::array<std::pair<std::string, std::function<Stage()>>, 6> stages{
        {{"city", [&] { return cityOf(frames); }},
         {"hall", [&] { return fileStage("engine hall", hall, assets, frames); }},
         {"field", [&] { return fieldStage(frames); }},
         {"materials", [&] { return manyMaterials(frames); }},
         {"boxes",
          [&] {
              return crowd("crowd of boxes", makeBox({1, 1, 1}), frames);
          }},
         {"balls", [&] { return crowd("crowd of balls", makeSphere(0.5, 16), frames); }}}};
    std::string cases;
    std::printf("%-24s %8s %7s  %-6s %9s %9s %9s %7s   per tile; ms of %s time, beside depth\n", "scene", "samples",
                "items", "order", "calls", "states", "draw", "ratio", clock == wallMs ? "wall" : "processor");
    for (const auto& [name, make] : stages) {
        if (!only.empty() && only != name) continue;
        Stage stage = make();
        for (const int samples : {4, 1}) measure(stage, *surface, samples, *kind, clock, cases);
    }
    if (!json.empty()) std::ofstream(json) << "{\"cases\":[" << cases << "\n]}\n";
    return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench(argc, argv);
}
