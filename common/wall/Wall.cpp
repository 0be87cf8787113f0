#include "common/wall/Wall.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {

namespace {

/// First pixel of the `index`-th part, where neighbours are `step` pixels apart (negative: they overlap).
template <typename SizeOf>
int startOf(int index, int step, SizeOf sizeOf) {
    int start = 0;
    for (int i = 0; i < index; ++i) start += sizeOf(i) + step;
    return start;
}

template <typename SizeOf>
int totalOf(int count, int step, SizeOf sizeOf) {
    return startOf(count, step, sizeOf) - step;
}

std::string_view suffixOf(Eye eye) {
    switch (eye) {
        case Eye::kCenter:
            return "";
        case Eye::kLeft:
            return "-left";
        case Eye::kRight:
            return "-right";
    }
    return "";
}

/// `total` in `count` parts whose sizes differ by at most one, the bigger ones first.
std::vector<int> shares(int total, int count) {
    std::vector<int> parts(static_cast<std::size_t>(count), total / count);
    for (int i = 0; i < total % count; ++i) ++parts[static_cast<std::size_t>(i)];
    return parts;
}

Expected<void> shareOut(int visiblePx, int count, int overlapPx, int& each, std::vector<int>& uneven,
                        std::string_view what, const std::string& screen) {
    const std::vector<int> parts = shares(visiblePx + (count - 1) * overlapPx, count);
    if (parts.back() <= overlapPx) {
        return fail(ErrorCode::kUsage,
                    fmt::format("{} pixels are too few for the {} {} of screen \"{}\"{}", visiblePx, count, what,
                                screen, overlapPx > 0 ? fmt::format(" that overlap by {} pixels", overlapPx) : ""));
    }
    each = parts.front();
    uneven = parts.front() == parts.back() ? std::vector<int>() : parts;
    return {};
}

}  // namespace

int Screen::Grid::columnWidthPx(int column) const {
    return columnWidthsPx.empty() ? tileWidthPx : columnWidthsPx[static_cast<std::size_t>(column)];
}

int Screen::Grid::rowHeightPx(int row) const {
    return rowHeightsPx.empty() ? tileHeightPx : rowHeightsPx[static_cast<std::size_t>(row)];
}

Vec3d User::eye(Eye which) const {
    const double side = which == Eye::kLeft ? -0.5 : which == Eye::kRight ? 0.5 : 0.0;
    return position + orientation.normalized() * Vec3d(side * eyeSeparationMetres, 0, 0);
}

const Screen* Wall::findScreen(std::string_view screen) const {
    const auto it = std::find_if(screens.begin(), screens.end(), [&](const Screen& s) { return s.name == screen; });
    return it == screens.end() ? nullptr : &*it;
}

const User* Wall::findUser(std::string_view user) const {
    const auto it = std::find_if(users.begin(), users.end(), [&](const User& u) { return u.name == user; });
    return it == users.end() ? nullptr : &*it;
}

ScreenPixels screenPixels(const Screen& screen) {
    const Screen::Grid& g = screen.grid;
    return {.width = totalOf(g.columns, g.bezelXPx - g.overlapXPx, [&](int c) { return g.columnWidthPx(c); }),
            .height = totalOf(g.rows, g.bezelYPx - g.overlapYPx, [&](int r) { return g.rowHeightPx(r); })};
}

ScreenPixels mosaicPixels(const Screen& screen) {
    const Screen::Grid& g = screen.grid;
    return {.width = totalOf(g.columns, -g.overlapXPx, [&](int c) { return g.columnWidthPx(c); }),
            .height = totalOf(g.rows, -g.overlapYPx, [&](int r) { return g.rowHeightPx(r); })};
}

std::vector<Tile> layoutTiles(const Wall& wall) {
    std::vector<Tile> tiles;
    for (const WallHost& host : wall.hosts) {
        for (const TileAssignment& assigned : host.tiles) {
            const Screen* screen = wall.findScreen(assigned.screen);
            TESSERA_CHECK(screen != nullptr, "a tile of an unknown screen: checkWall was not called");
            const Screen::Grid& g = screen->grid;
            const auto width = [&](int c) { return g.columnWidthPx(c); };
            const auto height = [&](int r) { return g.rowHeightPx(r); };
            Tile tile;
            tile.name =
                fmt::format("{}-{}-{}{}", assigned.screen, assigned.column, assigned.row, suffixOf(assigned.eye));
            tile.host = host.name;
            tile.screen = assigned.screen;
            tile.column = assigned.column;
            tile.row = assigned.row;
            tile.eye = assigned.eye;
            tile.user = assigned.user;
            tile.output = assigned.output;
            tile.rect = {.x = startOf(assigned.column, g.bezelXPx - g.overlapXPx, width),
                         .y = startOf(assigned.row, g.bezelYPx - g.overlapYPx, height),
                         .width = width(assigned.column),
                         .height = height(assigned.row)};
            tile.mosaicRect = tile.rect;
            tile.mosaicRect.x = startOf(assigned.column, -g.overlapXPx, width);
            tile.mosaicRect.y = startOf(assigned.row, -g.overlapYPx, height);
            tiles.push_back(std::move(tile));
        }
    }
    return tiles;
}

std::vector<Tile> tilesOf(const Wall& wall, std::string_view host) {
    std::vector<Tile> tiles = layoutTiles(wall);
    std::erase_if(tiles, [&](const Tile& tile) { return tile.host != host; });
    return tiles;
}

Expected<Wall> withSize(const Wall& wall, int widthPx, int heightPx) {
    const int limit = WallLimits().maxScreenPixels;
    const auto screens = static_cast<int>(wall.screens.size());
    TESSERA_CHECK(screens > 0, "a wall without screens: checkWall was not called");
    if (widthPx < 1 || heightPx < 1 || widthPx > limit * screens || heightPx > limit) {
        return fail(ErrorCode::kUsage, fmt::format("a wall of {} x {} pixels: each number has to be at least 1, and no "
                                                   "screen's picture may be larger than {}",
                                                   widthPx, heightPx, limit));
    }
    std::int64_t oldWidth = 0, oldHeight = 0;
    for (const Screen& screen : wall.screens) {
        const ScreenPixels pixels = mosaicPixels(screen);
        oldWidth += pixels.width;
        oldHeight = std::max<std::int64_t>(oldHeight, pixels.height);
    }
    Wall sized = wall;
    std::int64_t before = 0;
    for (Screen& screen : sized.screens) {
        const ScreenPixels old = mosaicPixels(screen);
        // The differences of rounded-up running sums: they add up to the whole, and the odd rest goes to the first
        // ones.
        const auto upTo = [&](std::int64_t px) { return (px * widthPx + oldWidth - 1) / oldWidth; };
        const auto width = static_cast<int>(upTo(before + old.width) - upTo(before));
        const auto height = static_cast<int>((2 * std::int64_t{old.height} * heightPx + oldHeight) / (2 * oldHeight));
        before += old.width;
        Screen::Grid& g = screen.grid;
        // Frames between tiles keep their width in metres.
        const auto scaled = [](int bezel, int now, int then) {
            return static_cast<int>((2 * std::int64_t{bezel} * now + then) / (2 * std::int64_t{then}));
        };
        g.bezelXPx = scaled(g.bezelXPx, width, old.width);
        g.bezelYPx = scaled(g.bezelYPx, height, old.height);
        if (auto ok = shareOut(width, g.columns, g.overlapXPx, g.tileWidthPx, g.columnWidthsPx, "columns", screen.name);
            !ok) {
            return tl::unexpected(ok.error());
        }
        if (auto ok = shareOut(height, g.rows, g.overlapYPx, g.tileHeightPx, g.rowHeightsPx, "rows", screen.name);
            !ok) {
            return tl::unexpected(ok.error());
        }
    }
    if (auto ok = checkWall(sized); !ok) return tl::unexpected(ok.error());
    return sized;
}

Expected<void> checkWall(const Wall& wall) {
    if (std::optional<WallFault> fault = findWallFault(wall))
        return fail(ErrorCode::kBadInput, std::move(fault->message));
    return {};
}

}  // namespace tessera
