/// Scenes to draw, and what it costs to draw them: for the benchmarks of drawing.
#pragma once

#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "common/cores/Geometry.h"
#include "common/scene/Aspect.h"
#include "tests/bench/DrawingCity.h"

namespace tessera::bench {

/// Processor time of all threads: what stays comparable when others use the machine, and what counts where each core
/// has a tile of its own.
[[nodiscard]] inline double processorMs() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

template <typename T>
[[nodiscard]] T orExit(Expected<T> value) {
    if (value) return std::move(*value);
    std::fprintf(stderr, "%s\n", value.error().message.c_str());
    std::exit(exitCode(value.error().code));
}

struct Stage {
    std::string name;
    Aspect aspect;
    std::vector<View> views;  ///< one per frame
};

[[nodiscard]] Stage cityStage(std::string name, const City& city, int frames);
/// A field: 8,000 things on the ground, nothing before another one but by chance.
[[nodiscard]] Stage fieldStage(int frames);
/// The plant of the test data, 140 times: 50 million triangles. Moving through it.
[[nodiscard]] Expected<Stage> plantStage(const std::string& folder, int frames);
/// A scanned mesh, each triangle divided into sixteen and roughened: a million triangles. The camera goes along it,
/// close up.
[[nodiscard]] Expected<Stage> scanStage(const std::string& file, int frames);

/// Of the files, all that has triangles.
[[nodiscard]] Expected<std::vector<Geometry>> readGeometries(const std::vector<std::string>& files);

/// Three cullers in turns on the four tiles of the bench's screen, 4 samples; processor time.
struct CullCost {
    std::vector<double> ours, all, oracle;                               ///< ms per frame, of the four tiles together
    double visible = 0, drawn = 0, inFrustum = 0;                        ///< items, means per tile
    double cullMs = 0;                                                   ///< of `ours`, mean of a frame
    std::uint64_t triangles = 0, allTriangles = 0, oracleTriangles = 0;  ///< given to GL, in all
    std::uint64_t oracleWrong = 0;  ///< tiles, warming up included, whose picture the oracle's items do not make
};
/// `ours` beside `all`, and beside the items that leave a sample (VisibleItems.h), known for nothing. `tellEach`:
/// prints a line for each frame and tile.
[[nodiscard]] CullCost measureCulling(Stage& stage, CullerKind ours, CullerKind all, bool withOracle,
                                      bool tellEach = false);

}  // namespace tessera::bench
