#include "common/output/BlendRamp.h"

#include <algorithm>
#include <map>
#include <optional>

namespace tessera {
namespace {

/// From 0 to 1, level at both ends. smooth(t) + smooth(1 - t) = 1.
double smooth(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

double shareAcross(double x, double size, int before, int behind) {
    double share = 1;
    if (before > 0 && x < before) share *= smooth(x / before);
    if (behind > 0 && size - x < behind) share *= smooth((size - x) / behind);
    return share;
}

int partAcross(double x, double size, int before, int behind) {
    return x < before ? 0 : size - x < behind ? 2 : 1;
}

}  // namespace

int TileOverlaps::partAt(double x, double y) const {
    return 3 * partAcross(y, heightPx, top, bottom) + partAcross(x, widthPx, left, right);
}

double TileOverlaps::shareAt(double x, double y) const {
    return shareAcross(x, widthPx, left, right) * shareAcross(y, heightPx, top, bottom);
}

TileOverlaps overlapsOf(const Screen& screen, int column, int row) {
    const Screen::Grid& g = screen.grid;
    return {.widthPx = g.columnWidthPx(column),
            .heightPx = g.rowHeightPx(row),
            .left = column > 0 ? g.overlapXPx : 0,
            .right = column + 1 < g.columns ? g.overlapXPx : 0,
            .top = row + 1 < g.rows ? g.overlapYPx : 0,
            .bottom = row > 0 ? g.overlapYPx : 0};
}

BlackLift blackLiftOf(const Wall& wall, const Tile& tile) {
    const Screen& screen = *wall.findScreen(tile.screen);
    std::map<std::pair<int, int>, double> black;  // by column and row
    BlackLift lift;
    for (const WallHost& host : wall.hosts) {
        for (const TileAssignment& other : host.tiles) {
            if (other.screen != tile.screen || other.eye != tile.eye) continue;
            black[{other.column, other.row}] = other.output.black;
            lift.largestBlack = std::max(lift.largestBlack, other.output.black);
        }
    }
    if (lift.largestBlack == 0) return lift;
    // All projectors that light a part of a tile: those of its own row and column, and of the neighbours that it
    // overlaps.
    const auto lightOf = [&](int column, int row, int part) -> std::optional<double> {
        const TileOverlaps over = overlapsOf(screen, column, row);
        const int across = part % 3, down = part / 3;
        const int sizes[3] = {over.left, 1, over.right}, heights[3] = {over.top, 1, over.bottom};
        if (sizes[across] == 0 || heights[down] == 0) return std::nullopt;  // there is no such part
        double sum = 0;
        for (int c = std::min(column, column + across - 1); c <= std::max(column, column + across - 1); ++c) {
            for (int r = std::min(row, row + 1 - down); r <= std::max(row, row + 1 - down); ++r) {
                const auto at = black.find({c, r});
                if (at != black.end()) sum += at->second;
            }
        }
        return sum;
    };
    double brightest = 0, darkest = 1e300;
    for (const auto& [place, unused] : black) {
        for (int part = 0; part < 9; ++part) {
            const auto light = lightOf(place.first, place.second, part);
            if (!light) continue;
            brightest = std::max(brightest, *light);
            darkest = std::min(darkest, *light);
        }
    }
    lift.most = brightest - darkest;
    for (int part = 0; part < 9; ++part) {
        const auto light = lightOf(tile.column, tile.row, part);
        if (light) lift.added[static_cast<std::size_t>(part)] = brightest - *light;
    }
    return lift;
}

}  // namespace tessera
