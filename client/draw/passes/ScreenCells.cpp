#include "client/draw/passes/ScreenCells.h"

#include <algorithm>

namespace tessera {
namespace {

/// From the screen's clip space to that of the cell whose lower left pixel is (x, y), in double: rounded only once.
ScreenCamera cameraOfCell(const ScreenCamera& screen, int x, int y) {
    ScreenCamera cell = screen;
    cell.pixels = {.width = kCellWidthPx, .height = kCellHeightPx};
    const auto axis = [&](Eigen::Index row, int from, int cellPx, int screenPx) {
        // pixel = (ndc + 1) / 2 · screenPx on the screen, and (ndc + 1) / 2 · cellPx + from.
        const double scale = static_cast<double>(screenPx) / cellPx;
        const double shift = static_cast<double>(screenPx - 2 * from) / cellPx - 1;
        cell.clip_T_eye.row(row) = scale * screen.clip_T_eye.row(row) + shift * screen.clip_T_eye.row(3);
    };
    axis(0, x, kCellWidthPx, screen.pixels.width);
    axis(1, y, kCellHeightPx, screen.pixels.height);
    return cell;
}

}  // namespace

std::vector<CellPart> cellsOf(const ScreenCamera& camera, const PixelRect& rect) {
    std::vector<CellPart> cells;
    const int right = rect.x + rect.width, top = rect.y + rect.height;
    for (int y = rect.y / kCellHeightPx * kCellHeightPx; y < top; y += kCellHeightPx) {
        for (int x = rect.x / kCellWidthPx * kCellWidthPx; x < right; x += kCellWidthPx) {
            PixelRect part{.x = std::max(x, rect.x), .y = std::max(y, rect.y), .width = 0, .height = 0};
            part.width = std::min(x + kCellWidthPx, right) - part.x;
            part.height = std::min(y + kCellHeightPx, top) - part.y;
            PixelRect inCell = part;
            inCell.x -= x;
            inCell.y -= y;
            cells.push_back({.camera = cameraOfCell(camera, x, y), .onScreen = part, .inCell = inCell});
        }
    }
    return cells;
}

}  // namespace tessera
