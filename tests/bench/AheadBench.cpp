/// The longest frame when a camera turns towards what it has not seen: with uploads ahead of need, and without. One
/// tile of 960×540, four samples; processor time.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "client/draw/passes/UploadAhead.h"
#include "tests/bench/DrawingStage.h"

namespace tessera::bench {
namespace {

struct Turn {
    double longestMs = 0, medianMs = 0, longestSliceMs = 0;
    double extraMs = 0;  ///< of a frame over the same sight once more
    std::uint64_t mostBytes = 0, slices = 0;
};

/// From before the scene, looking away from it, around.
Turn turnAround(Stage& stage, bool ahead, int frames) {
    const auto surface = orExit(makeSurface("osmesa"));
    const auto renderer = orExit(Renderer::create(*surface, {.samples = 4}));
    RenderScene scene;
    scene.update(stage.aspect, nullptr);
    const Screen screen = benchScreen();
    const PixelRect rect{0, 0, screen.grid.tileWidthPx, screen.grid.tileHeightPx};
    RenderAction action(CullerKind::kAuto);
    UploadAhead uploads;
    Turn turn;
    std::vector<double> times;
    // Twice around: the second time all is there.
    for (int i = 0; i < 2 * frames; ++i) {
        View view;
        view.position = scene.bounds().center();
        view.position.z() = scene.bounds().upper.z() + 3;
        view.orientation = Quatd(Eigen::AngleAxisd(M_PI + 2 * M_PI * i / frames, Vec3d::UnitY()));
        const ScreenCamera camera = screenCamera(screen, User(), Eye::kCenter, view);
        const std::uint64_t before = renderer->uploadedMeshBytes() + renderer->uploadedTextureBytes();
        const double start = processorMs();
        const DrawList list = action.run(scene, camera, rect, nullptr);
        static_cast<void>(orExit(renderer->draw(stage.aspect, list, camera, rect)));
        const double ms = processorMs() - start;
        if (i == 0) {
            for (bool more = ahead; more; ++turn.slices) {
                const double begin = processorMs();
                more = orExit(uploads.step(*renderer, stage.aspect, scene, camera.eyeWorld));
                turn.longestSliceMs = std::max(turn.longestSliceMs, processorMs() - begin);
            }
            continue;
        }
        times.push_back(ms);
        if (i > frames)
            turn.extraMs = std::max(turn.extraMs, times[times.size() - 1 - static_cast<std::size_t>(frames)] - ms);
        turn.longestMs = std::max(turn.longestMs, ms);
        turn.mostBytes =
            std::max(turn.mostBytes, renderer->uploadedMeshBytes() + renderer->uploadedTextureBytes() - before);
    }
    std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
    turn.medianMs = times[times.size() / 2];
    return turn;
}

int bench(int argc, char** argv) {
    const char* data = std::getenv("TESSERA_TEST_DATA");
    std::string json, plant = fmt::format("{}/plant", data ? data : TESSERA_SOURCE_DIR "/../shared/data");
    int frames = 24;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string option = argv[i];
        if (option == "--json") json = argv[i + 1];
        if (option == "--plant") plant = argv[i + 1];
        if (option == "--frames") frames = std::max(2, std::atoi(argv[i + 1]));
    }
    Stage stage = orExit(plantStage(plant, 1));
    const Turn without = turnAround(stage, false, frames), with = turnAround(stage, true, frames);
    std::printf("%-28s %12s %12s %12s %16s %8s %14s   ms of processor time\n", stage.name.c_str(), "longest", "median",
                "extra", "most uploaded", "slices", "longest slice");
    for (const auto& [name, turn] : {std::pair("as it is needed", without), std::pair("ahead of need", with)})
        std::printf("%-28s %12.1f %12.1f %12.1f %13.1f MB %8llu %14.2f\n", name, turn.longestMs, turn.medianMs,
                    turn.extraMs, 1e-6 * static_cast<double>(turn.mostBytes),
                    static_cast<unsigned long long>(turn.slices), turn.longestSliceMs);
    if (!json.empty())
        std::ofstream(json) << fmt::format(
            R"({{"cases":[{{"case":"longest frame, ahead of need","peer":"as it is needed","ours":{},"theirs":{},)"
            R"("unit":"ms","ratio":{}}}]}})",
            with.longestMs, without.longestMs, with.longestMs / without.longestMs);
    return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench(argc, argv);
}
