#include "common/wall/PictureLayout.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>

namespace tessera {

PictureLayout layoutPicture(const Wall& wall, PictureKind kind, Eye eye) {
    PictureLayout layout;
    std::map<std::string, int> leftOf;
    for (const Screen& screen : wall.screens) {
        const ScreenPixels pixels = kind == PictureKind::kMosaic ? mosaicPixels(screen) : screenPixels(screen);
        leftOf[screen.name] = layout.widthPx;
        layout.widthPx += pixels.width;
        layout.heightPx = std::max(layout.heightPx, pixels.height);
    }
    const Eye wanted = eye == Eye::kCenter ? Eye::kLeft : eye;
    for (const Tile& tile : layoutTiles(wall)) {
        if (tile.eye != Eye::kCenter && tile.eye != wanted) continue;
        const PixelRect& rect = kind == PictureKind::kMosaic ? tile.mosaicRect : tile.rect;
        layout.places.push_back({.tile = tile.name,
                                 .xPx = leftOf.at(tile.screen) + rect.x,
                                 .yPx = layout.heightPx - rect.y - rect.height,
                                 .widthPx = rect.width,
                                 .heightPx = rect.height});
    }
    return layout;
}

bool isStereo(const Wall& wall) {
    for (const WallHost& host : wall.hosts) {
        for (const TileAssignment& tile : host.tiles) {
            if (tile.eye != Eye::kCenter) return true;
        }
    }
    return false;
}

Expected<ScreenPixels> parsePixels(std::string_view text) {
    ScreenPixels pixels;
    const char* const end = text.data() + text.size();
    const auto [afterWidth, widthError] = std::from_chars(text.data(), end, pixels.width);
    if (widthError == std::errc() && afterWidth != end && *afterWidth == 'x') {
        const auto [afterHeight, heightError] = std::from_chars(afterWidth + 1, end, pixels.height);
        if (heightError == std::errc() && afterHeight == end && pixels.width > 0 && pixels.height > 0) return pixels;
    }
    return fail(ErrorCode::kUsage,
                fmt::format("\"{}\" is no size in pixels; write WIDTHxHEIGHT, e.g. 1920x1080", text));
}

}  // namespace tessera
