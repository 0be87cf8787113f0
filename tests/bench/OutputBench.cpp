/// What an output adds to a picture on its way into a window, of one core's time: 1920 × 1080, beside a copy of the
/// same bytes. The median of 41 turns, all rows in each turn, so that what else the machine does hits all of them.
/// `--json FILE`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "client/output/OutputMaker.h"
#include "tests/bench/CaseFile.h"

namespace tessera::bench {
namespace {

constexpr int kWidthPx = 1920, kHeightPx = 1080, kTurns = 41;

Wall outputWall(const std::function<void(TileOutput&)>& set) {
    Wall wall;
    TileOutput output;
    set(output);
    const bool stereo = output.stereo != StereoPacking::kNone;
    Screen screen{.name = "s", .lowerLeft = {-1.6, 0.6, 0}, .lowerRight = {1.6, 0.6, 0}, .upperLeft = {-1.6, 2.4, 0}};
    screen.grid = {.columns = stereo ? 1 : 2,
                   .rows = 1,
                   .tileWidthPx = kWidthPx,
                   .tileHeightPx = kHeightPx,
                   .overlapXPx = stereo ? 0 : 256};
    wall.screens = {screen};
    wall.users = {User{.name = "u"}};
    if (stereo)
        wall.hosts = {{.name = "h",
                       .tiles = {{.screen = "s", .eye = Eye::kLeft, .user = "u", .output = output},
                                 {.screen = "s", .eye = Eye::kRight, .user = "u"}}}};
    else
        wall.hosts = {{.name = "h",
                       .tiles = {{.screen = "s", .user = "u", .output = output},
                                 {.screen = "s", .column = 1, .user = "u", .output = output}}}};
    return wall;
}

void bend(TileOutput& out) {
    WarpMesh mesh{.columns = 33, .rows = 19, .nodes = {}};
    for (int row = 0; row < mesh.rows; ++row) {
        for (int column = 0; column < mesh.columns; ++column) {
            const float u = static_cast<float>(column) / 32, v = static_cast<float>(row) / 18, x = 2 * u - 1,
                        y = 2 * v - 1;
            mesh.nodes.push_back(
                {.x = x * (1 - 0.05f * y * y), .y = y * (0.9f + 0.1f * x * x), .u = u, .v = v, .intensity = 1});
        }
    }
    out.warp = std::make_shared<const WarpMesh>(mesh);
}

/// Of this thread: what others take of the machine is not counted.
struct ProcessorTime {
    static double now() {
        timespec time{};
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
        return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    }
};

struct OutputRow {
    std::string name;
    std::function<void(TileOutput&)> set;
};

int runAll(CaseFile file) {
    const std::vector<OutputRow> rows = {
        {"blend of 256 pixels", [](TileOutput& o) { o.blend = true; }},
        {"colour (gain, gamma)",
         [](TileOutput& o) {
             o.gain = {1, 0.9, 0.8};
             o.gamma = {2.2, 2.4, 2.2};
         }},
        {"warp", bend},
        {"warp, blend, black, colour",
         [](TileOutput& o) {
             bend(o);
             o.blend = true;
             o.black = 0.002;
             o.gain = {1, 0.9, 0.8};
         }},
        {"two eyes, ROWS", [](TileOutput& o) { o.stereo = StereoPacking::kRows; }},
        {"two eyes, SIDE_BY_SIDE", [](TileOutput& o) { o.stereo = StereoPacking::kSideBySide; }},
        {"two eyes, ANAGLYPH", [](TileOutput& o) { o.stereo = StereoPacking::kAnaglyph; }},
        {"two eyes, ANAGLYPH, warp",
         [](TileOutput& o) {
             bend(o);
             o.stereo = StereoPacking::kAnaglyph;
         }},
    };
    using Clock = ProcessorTime;
    const auto ms = [](double seconds) { return 1000 * seconds; };
    std::mt19937 random(1);
    const std::size_t bytes = std::size_t{4} * kWidthPx * kHeightPx;
    std::vector<std::uint8_t> left(bytes), right(bytes), copy(bytes);
    // Smooth as pictures are, with a little noise.
    for (std::size_t i = 0; i < bytes; ++i) {
        const double x = static_cast<double>(i / 4 % kWidthPx), y = static_cast<double>(i / 4 / kWidthPx),
                     c = static_cast<double>(i % 4);
        left[i] = static_cast<std::uint8_t>(124 + 110 * std::sin(0.01 * x * (c + 1) + 0.013 * y) +
                                            static_cast<double>(random() % 8));
        right[i] = static_cast<std::uint8_t>(124 + 110 * std::sin(0.01 * (x + 30) * (c + 1) + 0.013 * y) +
                                             static_cast<double>(random() % 8));
    }
    const std::uint8_t* const pictures[2] = {left.data(), right.data()};
    std::vector<OutputMaker> makers;
    std::vector<double> made;
    for (const OutputRow& row : rows) {
        const Wall wall = outputWall(row.set);
        const auto from = Clock::now();
        auto maker = OutputMaker::make(wall, outputsOf(wall, layoutTiles(wall))[0].name);
        made.push_back(ms(Clock::now() - from));
        if (!maker) return fmt::print(stderr, "{}\n", maker.error().message), 1;
        makers.push_back(std::move(*maker));
    }
    std::vector<std::vector<double>> times(rows.size() + 1);
    for (int turn = 0; turn < kTurns; ++turn) {
        const auto start = Clock::now();
        std::memcpy(copy.data(), left.data(), bytes);
        times.back().push_back(ms(Clock::now() - start));
        left[static_cast<std::size_t>(turn)] ^= copy[5];
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const auto from = Clock::now();
            (void)makers[i].draw({pictures, makers[i].tiles().size()});
            times[i].push_back(ms(Clock::now() - from));
        }
    }
    const auto median = [](std::vector<double> all) {
        return std::ranges::nth_element(all, all.begin() + kTurns / 2), all[kTurns / 2];
    };
    const double plain = median(times.back());
    fmt::print("{:<30} {:>8} {:>8} {:>10} {:>10}\n{:<30} {:>8.2f}\n", "1920 x 1080", "ms", "copies", "table, MB",
               "to make, ms", "a copy (memcpy)", plain);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const double drawn = median(times[i]);
        fmt::print("{:<30} {:>8.2f} {:>8.1f} {:>10.1f} {:>10.0f}\n", rows[i].name, drawn, drawn / plain,
                   static_cast<double>(makers[i].tableBytes()) / 1e6, made[i]);
        file.add(rows[i].name, "a copy of its bytes", drawn, plain, "ms");
    }
    return file.write();
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::runAll(tessera::bench::CaseFile(argc, argv));
}
