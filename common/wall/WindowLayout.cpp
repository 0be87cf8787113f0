#include "common/wall/WindowLayout.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace tessera {

namespace {

/// The windows of one screen and one eye.
struct EyeWindows {
    struct Cell {
        std::size_t place = 0;  ///< of the layout
        int column = 0, row = 0;
    };
    const Screen* screen = nullptr;
    std::vector<Cell> cells;
    bool blended = false, resized = false;
    std::vector<int> columns, rows;  ///< starts of cells, and the end: column 0 is left, row 0 is at the bottom
    std::vector<int> widths, heights;
    int width = 0, height = 0;
    int x = 0, y = 0;
};

/// First pixels of cells of these sizes.
std::vector<int> startsOf(const std::vector<int>& sizes, int step) {
    std::vector<int> starts;
    int next = 0;
    for (const int size : sizes) {
        starts.push_back(next);
        next += size + step;
    }
    return starts;
}

/// Makes cells as large as what stands in them.
void measure(EyeWindows& eye, const WindowLayout& layout) {
    const Screen::Grid& grid = eye.screen->grid;
    for (int c = 0; c < grid.columns; ++c) eye.widths.push_back(grid.columnWidthPx(c));
    for (int r = 0; r < grid.rows; ++r) eye.heights.push_back(grid.rowHeightPx(r));
    if (eye.resized) {
        // Outputs alone count: where all of a column are smaller than their tiles, it is smaller too.
        std::vector<int> widths(eye.widths.size(), 0), heights(eye.heights.size(), 0);
        for (const EyeWindows::Cell& cell : eye.cells) {
            int& width = widths[static_cast<std::size_t>(cell.column)];
            int& height = heights[static_cast<std::size_t>(cell.row)];
            width = std::max(width, layout.places[cell.place].width);
            height = std::max(height, layout.places[cell.place].height);
        }
        for (std::size_t c = 0; c < widths.size(); ++c)
            if (widths[c] > 0) eye.widths[c] = widths[c];
        for (std::size_t r = 0; r < heights.size(); ++r)
            if (heights[r] > 0) eye.heights[r] = heights[r];
    }
    const bool apart = eye.blended || eye.resized;
    const int stepX = grid.bezelXPx - (apart ? 0 : grid.overlapXPx),
              stepY = grid.bezelYPx - (apart ? 0 : grid.overlapYPx);
    eye.columns = startsOf(eye.widths, stepX);
    eye.rows = startsOf(eye.heights, stepY);
    eye.width = eye.columns.back() + eye.widths.back();
    eye.height = eye.rows.back() + eye.heights.back();
}

struct Size {
    int width = 0, height = 0;
};

/// Of the picture that a projector gets, both eyes where they share it.
Size sizeOfOutput(const Tile& tile) {
    const TileOutput& out = tile.output;
    const int width = out.widthPx > 0 ? out.widthPx : tile.rect.width,
              height = out.heightPx > 0 ? out.heightPx : tile.rect.height;
    return {out.stereo == StereoPacking::kSideBySideFull ? 2 * width : width,
            out.stereo == StereoPacking::kTopBottomFull ? 2 * height : height};
}

/// Sets places of `eyes` in rows of at most `perRow`, each row in the middle.
Size stack(std::vector<EyeWindows*> eyes, std::size_t perRow, int gap) {
    Size all;
    std::vector<int> rowWidths;
    for (std::size_t first = 0; first < eyes.size(); first += perRow) {
        const std::size_t end = std::min(eyes.size(), first + perRow);
        int x = 0, high = 0;
        for (std::size_t i = first; i < end; ++i) {
            eyes[i]->x = x;
            x += eyes[i]->width + gap;
            high = std::max(high, eyes[i]->height);
        }
        const int top = all.height + (first > 0 ? gap : 0);
        for (std::size_t i = first; i < end; ++i) eyes[i]->y = top + (high - eyes[i]->height) / 2;
        rowWidths.push_back(x - gap);
        all.width = std::max(all.width, x - gap);
        all.height = top + high;
    }
    for (std::size_t i = 0; i < eyes.size(); ++i) eyes[i]->x += (all.width - rowWidths[i / perRow]) / 2;
    return all;
}

/// Of a desktop of 16:9: how large it leaves each pixel.
double scaleOf(const Size& size) {
    return std::min(16.0 / size.width, 9.0 / size.height);
}

}  // namespace

const Tile* partnerOf(const Tile& tile, const std::vector<Tile>& tiles) {
    if (tile.eye == Eye::kCenter) return nullptr;
    const auto at = std::ranges::find_if(tiles, [&](const Tile& other) {
        const Tile& left = tile.eye == Eye::kLeft ? tile : other;
        return other.host == tile.host && other.eye != tile.eye && other.screen == tile.screen &&
               other.column == tile.column && other.row == tile.row && left.output.stereo != StereoPacking::kNone;
    });
    return at == tiles.end() ? nullptr : &*at;
}

WindowLayout layoutWindows(const Wall& wall) {
    WindowLayout layout;
    const std::vector<Tile> tiles = layoutTiles(wall);
    // Left and both eyes first, then the right one.
    std::vector<std::array<EyeWindows, 2>> screens(wall.screens.size());
    for (const Tile& tile : tiles) {
        if (tile.eye == Eye::kRight && partnerOf(tile, tiles)) continue;
        const Screen* const screen = wall.findScreen(tile.screen);
        EyeWindows& eye =
            screens[static_cast<std::size_t>(screen - wall.screens.data())][tile.eye == Eye::kRight ? 1 : 0];
        const auto [width, height] = sizeOfOutput(tile);
        eye.screen = screen;
        eye.cells.push_back({layout.places.size(), tile.column, tile.row});
        eye.blended = eye.blended || tile.output.blend || tile.output.blendPicture;
        eye.resized = eye.resized || width != tile.rect.width || height != tile.rect.height;
        layout.places.push_back({.tile = tile.name, .x = 0, .y = 0, .width = width, .height = height});
    }
    std::vector<EyeWindows*> eyes;
    bool pairs = true;  // each screen has windows for the right eye
    for (auto& screen : screens) {
        for (EyeWindows& eye : screen) {
            if (eye.cells.empty()) {
                pairs = false;
                continue;
            }
            measure(eye, layout);
            eyes.push_back(&eye);
        }
    }
    if (eyes.empty()) return layout;
    int longest = 0;
    for (const EyeWindows* eye : eyes) longest = std::max({longest, eye->width, eye->height});
    const int gap = std::max(1, longest / 32);
    // Where all screens have two eyes, rows begin with a left one: eyes stand beside each other, or each below the
    // other one.
    std::vector<EyeWindows*> below = eyes;
    if (pairs)
        std::stable_partition(below.begin(), below.end(), [&](const EyeWindows* eye) {
            return eye == &screens[static_cast<std::size_t>(eye->screen - wall.screens.data())][0];
        });
    std::optional<std::pair<const std::vector<EyeWindows*>*, std::size_t>> best;
    double bestScale = 0;
    const auto tryRows = [&](const std::vector<EyeWindows*>& order, std::size_t perRow) {
        // The first of equal ones: the longest rows, eyes beside each other.
        const double scale = scaleOf(stack(order, perRow, gap));
        if (best && scale <= bestScale) return;
        best = {&order, perRow};
        bestScale = scale;
    };
    for (std::size_t perRow = eyes.size(); perRow > 0; --perRow)
        if (!pairs || perRow % 2 == 0) tryRows(eyes, perRow);
    if (pairs) tryRows(below, wall.screens.size());
    const Size size = stack(*best->first, best->second, gap);
    layout.width = size.width;
    layout.height = size.height;
    for (const EyeWindows* eye : eyes) {
        for (const EyeWindows::Cell& cell : eye->cells) {
            WindowLayout::Place& place = layout.places[cell.place];
            const auto c = static_cast<std::size_t>(cell.column), r = static_cast<std::size_t>(cell.row);
            place.x = eye->x + eye->columns[c] + (eye->widths[c] - place.width) / 2;
            place.y = eye->y + eye->height - eye->rows[r] - eye->heights[r] + (eye->heights[r] - place.height) / 2;
        }
    }
    return layout;
}

}  // namespace tessera
