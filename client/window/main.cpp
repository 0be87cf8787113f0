/// tessera-window: shows one tile's picture on a monitor.
#include <sys/prctl.h>
#include <unistd.h>
#include <csignal>
#include <cstdio>

#include <fmt/format.h>

#include "client/window/TileWindow.h"
#include "common/base/Version.h"
#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"
#include "common/options/Options.h"

namespace tessera {
namespace {

/// What becomes of a tile's picture, by a wall as it travels.
Expected<OutputMaker> outputIn(const std::string& wallFile, const std::string& tile) {
    const Expected<Bytes> bytes = readFile(wallFile, kMaxWallWireBytes);
    if (!bytes) return tl::unexpected(bytes.error());
    const Expected<Wall> wall = decodeWall(*bytes);
    if (!wall) return tl::unexpected(wall.error());
    return OutputMaker::make(*wall, tile);
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    using namespace tessera;
    WindowOptions options;
    options.title = "Tessera";
    std::vector<int> part;
    bool monitors = false;
    int parent = 0;
    Options commandLine("tessera-window",
                        "Shows what a tessera-client shows of one tile, on a monitor of this\nmachine. Escape, or "
                        "closing the window, ends it.",
                        versionText("tessera-window"));
    const Option file = commandLine.option("file", options.frameFiles, "OUTPUT/tiles/TILE/shown.frame of the client")
                            .typeName("FILE")
                            .expected(0, 2);
    commandLine.option("--title", options.title, "Of the window").typeName("TEXT");
    commandLine.option("--monitor", options.monitor, "Its number or name (the first one)").typeName("M");
    commandLine.flag("--full-screen", options.fullScreen, "All of that monitor");
    commandLine.flag("--vsync", options.vsync, "In step with the monitor, by the graphics driver");
    commandLine
        .option("--part", part,
                "No full screen: the tile's place on its wall, and\nthe wall's size, in pixels from the upper left")
        .typeName("X Y W H WALL_W WALL_H")
        .expected(6)
        .range(0, 1 << 30);
    commandLine
        .option("--log", options.log,
                "A line per picture: frame, shown by its host,\nstood in the window (ns, CLOCK_MONOTONIC)")
        .typeName("FILE");
    commandLine.flag("--monitors", monitors, "Says which monitors there are").excludes(file);
    // Of the client that starts windows: the wall whose output this is, as bytes, and which; FILE is one of each of its
    // tiles.
    std::string wall, tile;
    commandLine.option("--wall", wall).hidden();
    commandLine.option("--tile", tile).hidden();
    // For tests: as if somebody had pressed F1.
    commandLine.flag("--show-keys", options.showsKeys).hidden();
    // They do not outlive it.
    commandLine.option("--parent", parent).hidden();
    commandLine.option("--input", options.input).hidden();
    if (const std::optional<int> code = commandLine.parse(argc, argv)) return *code;
    if (parent > 0 && (::prctl(PR_SET_PDEATHSIG, SIGTERM) != 0 || ::getppid() != parent)) return 0;
    const auto end = [](const Expected<void>& done) {
        if (done) return 0;
        fmt::print(stderr, "tessera-window: {}\n", done.error().message);
        return exitCode(done.error().code);
    };
    if (monitors) {
        const auto found = monitorsHere();
        if (found) fmt::print("{}", describe(*found));
        return end(found.map([](const auto&) {}));
    }
    if (options.frameFiles.empty()) return end(fail(ErrorCode::kUsage, "whose picture? FILE is missing; see --help"));
    if (!part.empty()) {
        options.part = PlacedPart{{part[0], part[1], part[2], part[3]}, part[4], part[5]};
        if (part[2] < 1 || part[3] < 1 || part[0] > part[4] - part[2] || part[1] > part[5] - part[3])
            return end(fail(ErrorCode::kUsage, "--part does not lie on its wall"));
    }
    if (!wall.empty()) {
        auto output = outputIn(wall, tile);
        if (!output) return end(failWith("the output of tile " + tile, output.error()));
        options.output = std::move(*output);
    }
    if (options.frameFiles.size() != (options.output ? options.output->tiles().size() : 1))
        return end(fail(ErrorCode::kUsage, "one FILE is shown, or one of each tile of an output"));
    return end(runWindow(std::move(options)));
}
