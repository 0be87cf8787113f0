#include <chrono>
#include <cstring>
#include <thread>

#include "common/image/SharedFrame.h"
#include "tests/bench/DrawingRows.h"
#include "tests/bench/DrawingStage.h"
#include "tests/integration/Process.h"

namespace tessera::bench {

void readBackRows(SceneTable& table) {
    table.begin("a tile of 1920x1080; wall time");
    const auto ms = [](Duration d) { return std::chrono::duration<double, std::milli>(d).count(); };
    Aspect nothing;
    RenderScene scene;
    scene.update(nothing, nullptr);
    const auto surface = orExit(makeSurface("osmesa"));
    const auto renderer = orExit(Renderer::create(*surface, {.samples = 1}));
    RenderAction action(CullerKind::kAuto);
    const ScreenCamera camera = screenCamera(benchScreen(), User(), Eye::kCenter, View());
    const PixelRect rect{.x = 0, .y = 0, .width = 1920, .height = 1080};
    const test::TemporaryFolder folder;
    SharedFrameWriter shown =
        orExit(SharedFrameWriter::create(folder.path() + "/shown.frame", rect.width, rect.height));
    // As many bytes, which other threads have just written as GL's do, to a file that is mapped as the one of the shown
    // image.
    const std::size_t bytes = 4u * 1920 * 1080;
    std::vector<std::uint8_t> from(bytes);
    SharedFrameWriter other =
        orExit(SharedFrameWriter::create(folder.path() + "/other.frame", rect.width, rect.height));
    std::vector<double> ours, copies;
    for (std::uint64_t i = 0; i < 60; ++i) {
        const DrawList list = action.run(scene, camera, rect, nullptr);
        TimePoint start = clockNow();
        const PixelRows rows = shown.begin();
        double handed = ms(clockNow() - start);
        static_cast<void>(orExit(renderer->drawInto(nothing, list, camera, rect, rows).map([] { return 0; })));
        start = clockNow();
        shown.prepared(i);
        handed += ms(clockNow() - start);
        static_cast<void>(orExit(shown.show().map([] { return 0; })));
        if (i >= 10) ours.push_back(ms(renderer->lastCounts().readBack) + handed);
        std::uint8_t* const to = other.begin().rgbx;
        for (const std::size_t half : {std::size_t{0}, bytes / 2})
            std::jthread([&, half] { std::memset(from.data() + half, static_cast<int>(i), bytes / 2); }).join();
        start = clockNow();
        std::memcpy(to, from.data(), bytes);
        if (i >= 10) copies.push_back(ms(clockNow() - start));
        other.prepared(i);
        static_cast<void>(orExit(other.show().map([] { return 0; })));
    }
    table.add({
        .operation = "read back, and handed to whoever shows it",
        .peer = "memcpy of GL's picture",
        .ours = medianOf(ours),
        .theirs = medianOf(copies),
        .unit = "ms",
        .atMost = 1.2,
        .aim = 1.1,
    });
}

}  // namespace tessera::bench
