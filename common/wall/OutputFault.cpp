/// What can be wrong with the outputs of a wall, in words.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "common/base/LowerCase.h"
#include "common/wall/Wall.h"

namespace tessera {
namespace {

class OutputCheck {
public:
    OutputCheck(const Wall& wall, const OutputLimits& limits) : wall_(wall), limits_(limits) {}

    std::optional<OutputFault> run() {
        for (std::size_t h = 0; h < wall_.hosts.size(); ++h)
            for (std::size_t t = 0; t < wall_.hosts[h].tiles.size(); ++t)
                if (auto wrong = checkAlone(h, t)) return OutputFault{h, t, wordsOf(h, t) + *wrong};
        for (std::size_t h = 0; h < wall_.hosts.size(); ++h)
            for (std::size_t t = 0; t < wall_.hosts[h].tiles.size(); ++t)
                if (auto wrong = checkPair(h, t)) return OutputFault{h, t, wordsOf(h, t) + *wrong};
        if (auto wrong = checkMonitors()) return wrong;
        return checkBlends();
    }

private:
    using Wrong = std::optional<std::string>;

    [[nodiscard]] std::string wordsOf(std::size_t h, std::size_t t) const {
        const TileAssignment& tile = wall_.hosts[h].tiles[t];
        return fmt::format("the output of column {} row {} of screen \"{}\" (host \"{}\") ", tile.column, tile.row,
                           tile.screen, wall_.hosts[h].name);
    }
    [[nodiscard]] const Screen::Grid& gridOf(const TileAssignment& tile) const {
        return wall_.findScreen(tile.screen)->grid;
    }

    [[nodiscard]] Wrong checkAlone(std::size_t h, std::size_t t) const {
        const TileAssignment& tile = wall_.hosts[h].tiles[t];
        const TileOutput& out = tile.output;
        if (out.plain() && out.monitor.empty()) return std::nullopt;
        for (const std::string* text : {&out.monitor, &out.warpFile, &out.blendFile}) {
            if (text->size() > limits_.maxName) return fmt::format("has a name longer than {} bytes", limits_.maxName);
            if (std::ranges::any_of(*text, [](unsigned char c) { return c < 32 || c == 127; }))
                return "has a name with characters that cannot be seen";
        }
        const Screen::Grid& grid = gridOf(tile);
        const int width = out.widthPx == 0 ? grid.columnWidthPx(tile.column) : out.widthPx;
        const int height = out.heightPx == 0 ? grid.rowHeightPx(tile.row) : out.heightPx;
        if (auto wrong = checkSize(out, width, height)) return wrong;
        for (std::size_t c = 0; c < 3; ++c) {
            if (!(out.gain[c] >= 0 && out.gain[c] <= 4))
                return fmt::format("has a gain of {:.6g}: 0 to 4 are possible", out.gain[c]);
            if (!(out.gamma[c] >= 0.5 && out.gamma[c] <= 5))
                return fmt::format("has a gamma of {:.6g}: 0.5 to 5 are possible, 2.2 is usual", out.gamma[c]);
        }
        if (!(out.black >= 0 && out.black <= 0.1))
            return fmt::format("has a black of {:.6g} of its white: 0 to 0.1 are possible, 0.001 is usual", out.black);
        if (out.blend && (out.blendPicture || !out.blendFile.empty()))
            return "has ramps (blend) and a picture (blend_picture) to blend with: one of them";
        if (out.black > 0 && !out.blend && !out.blendPicture)
            return "has a black level and is not blended: add `blend: true`";
        if (out.blendPicture && out.blendPicture->size() > limits_.maxBlendBytes)
            return fmt::format("has a blend picture of {} bytes, at most {} are allowed", out.blendPicture->size(),
                               limits_.maxBlendBytes);
        if (!(out.blendPictureGamma >= 0.1 && out.blendPictureGamma <= 5))
            return fmt::format("has a blend_picture_gamma of {:.6g}: 0.1 to 5 are possible", out.blendPictureGamma);
        if (!out.warpFile.empty() && !out.warp)
            return fmt::format("names the warp mesh \"{}\", which is not there", out.warpFile);
        if (!out.blendFile.empty() && !out.blendPicture)
            return fmt::format("names the blend picture \"{}\", which is not there", out.blendFile);
        if (out.warp) {
            if (auto wrong = findWarpFault(*out.warp, limits_))
                return fmt::format("has the warp mesh \"{}\", which {}", out.warpFile, *wrong);
        }
        if (!out.blend) return std::nullopt;
        if (grid.overlapXPx == 0 && grid.overlapYPx == 0)
            return "is blended, but its screen has neither overlap_x_px nor overlap_y_px";
        for (int c = 0; c < grid.columns; ++c) {
            if (2 * grid.overlapXPx > grid.columnWidthPx(c))
                return fmt::format(
                    "is blended, and its screen's tiles of {} pixels overlap by {}: ramps want half a tile at most",
                    grid.columnWidthPx(c), grid.overlapXPx);
        }
        for (int r = 0; r < grid.rows; ++r) {
            if (2 * grid.overlapYPx > grid.rowHeightPx(r))
                return fmt::format(
                    "is blended, and its screen's tiles of {} pixels overlap by {}: ramps want half a tile at most",
                    grid.rowHeightPx(r), grid.overlapYPx);
        }
        return std::nullopt;
    }

    [[nodiscard]] Wrong checkSize(const TileOutput& out, int width, int height) const {
        if ((out.widthPx == 0) != (out.heightPx == 0)) return "has one of width_px and height_px: give both, or none";
        const int wide = out.stereo == StereoPacking::kSideBySideFull ? 2 : 1,
                  high = out.stereo == StereoPacking::kTopBottomFull ? 2 : 1;
        // Divided, not multiplied: the numbers may be anything.
        if (width < 1 || height < 1 || width > limits_.maxOutputPixels / wide ||
            height > limits_.maxOutputPixels / high)
            return fmt::format("has {} x {} pixels{}: 1 to {} each way are possible", width, height,
                               wide * high > 1 ? " for each eye" : "", limits_.maxOutputPixels);
        if (out.stereo == StereoPacking::kSideBySide && width % 2 != 0)
            return fmt::format("is {} pixels wide: SIDE_BY_SIDE halves that and wants an even number", width);
        if (out.stereo == StereoPacking::kTopBottom && height % 2 != 0)
            return fmt::format("is {} pixels high: TOP_BOTTOM halves that and wants an even number", height);
        return std::nullopt;
    }

    /// Two eyes on one output: said at the left one, drawn by one host.
    [[nodiscard]] Wrong checkPair(std::size_t h, std::size_t t) const {
        const WallHost& host = wall_.hosts[h];
        const TileAssignment& tile = host.tiles[t];
        if (tile.output.stereo == StereoPacking::kNone)
            return tile.output.swapEyes ? Wrong("swaps eyes without `stereo`") : std::nullopt;
        if (tile.eye != Eye::kLeft)
            return "says `stereo`, which stands at the tile of the left eye (eye: LEFT) and holds for both";
        const auto other = std::ranges::find_if(host.tiles, [&](const TileAssignment& o) {
            return o.eye == Eye::kRight && o.screen == tile.screen && o.column == tile.column && o.row == tile.row;
        });
        if (other == host.tiles.end())
            return "says `stereo`, but the tile of the right eye is not this host's: one host draws both eyes of an "
                   "output";
        if (!(other->output == TileOutput()))
            return "says `stereo`, and the tile of the right eye has an output too: the left one's holds for both";
        return std::nullopt;
    }

    /// Each takes all of its monitor. Two eyes of one output name it once: the right one's is empty.
    [[nodiscard]] std::optional<OutputFault> checkMonitors() const {
        for (std::size_t h = 0; h < wall_.hosts.size(); ++h) {
            std::map<std::string, std::size_t>
                firsts;  // by monitor, as findMonitor takes names: capitals make no difference
            for (std::size_t t = 0; t < wall_.hosts[h].tiles.size(); ++t) {
                const std::string monitor = lowerCase(wall_.hosts[h].tiles[t].output.monitor);
                if (monitor.empty()) continue;
                const auto [at, isFirst] = firsts.try_emplace(monitor, t);
                if (isFirst) continue;
                const TileAssignment &first = wall_.hosts[h].tiles[at->second], &tile = wall_.hosts[h].tiles[t];
                return OutputFault{
                    h, t,
                    wordsOf(h, t) +
                        fmt::format(
                            "is shown on monitor \"{}\", as that of column {} row {} of screen \"{}\" is{}: a monitor "
                            "shows one output, so name another one",
                            tile.output.monitor, first.column, first.row, first.screen,
                            first.eye != tile.eye ? " for the other eye (`stereo` shows both in one)" : "")};
            }
        }
        return std::nullopt;
    }

    /// Where one tile of a screen fades out, its neighbours have to fade in.
    [[nodiscard]] std::optional<OutputFault> checkBlends() const {
        struct First {
            int kind = 0;
            std::size_t host = 0, tile = 0;
        };
        std::map<std::pair<std::string, Eye>, First> firsts;
        for (std::size_t h = 0; h < wall_.hosts.size(); ++h) {
            for (std::size_t t = 0; t < wall_.hosts[h].tiles.size(); ++t) {
                const TileAssignment& tile = wall_.hosts[h].tiles[t];
                if (sharesLeftOnes(h, tile)) continue;
                const int kind = tile.output.blend ? 1 : tile.output.blendPicture ? 2 : 0;
                const auto [at, isFirst] = firsts.try_emplace({tile.screen, tile.eye}, First{kind, h, t});
                if (isFirst || at->second.kind == kind) continue;
                constexpr std::string_view kKinds[] = {"not blended", "blended by ramps", "blended by a picture"};
                const TileAssignment& first = wall_.hosts[at->second.host].tiles[at->second.tile];
                return OutputFault{
                    h, t,
                    wordsOf(h, t) +
                        fmt::format("is {}, that of column {} row {} {}: all tiles of a screen are blended alike",
                                    kKinds[kind], first.column, first.row, kKinds[at->second.kind])};
            }
        }
        return std::nullopt;
    }

    /// A right eye's tile that goes out with the left one's.
    [[nodiscard]] static bool sharesLeftOnes(const WallHost& host, const TileAssignment& tile) {
        return tile.eye == Eye::kRight && std::ranges::any_of(host.tiles, [&](const TileAssignment& o) {
                   return o.eye == Eye::kLeft && o.output.stereo != StereoPacking::kNone && o.screen == tile.screen &&
                          o.column == tile.column && o.row == tile.row;
               });
    }
    [[nodiscard]] bool sharesLeftOnes(std::size_t h, const TileAssignment& tile) const {
        return sharesLeftOnes(wall_.hosts[h], tile);
    }

    const Wall& wall_;
    const OutputLimits limits_;
};

}  // namespace

bool TileOutput::plain() const {
    TileOutput same;
    same.monitor = monitor;
    return *this == same;
}

bool TileOutput::operator==(const TileOutput& o) const {
    const auto sameThing = [](const auto& a, const auto& b) { return a == b || (a && b && *a == *b); };
    return monitor == o.monitor && widthPx == o.widthPx && heightPx == o.heightPx && stereo == o.stereo &&
           swapEyes == o.swapEyes && warpFile == o.warpFile && blendFile == o.blendFile && sameThing(warp, o.warp) &&
           sameThing(blendPicture, o.blendPicture) && blendPictureGamma == o.blendPictureGamma && blend == o.blend &&
           gain == o.gain && gamma == o.gamma && black == o.black && flipX == o.flipX && flipY == o.flipY;
}

std::optional<OutputFault> findOutputFault(const Wall& wall, const OutputLimits& limits) {
    return OutputCheck(wall, limits).run();
}

}  // namespace tessera
