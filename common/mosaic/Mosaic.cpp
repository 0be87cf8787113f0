#include "common/mosaic/Mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace tessera {

namespace {

/// Where each screen's picture stands in the whole.
struct Arrangement {
    std::map<std::string, int> left;  ///< by screen
    int width = 0, height = 0;
};

Arrangement arrange(const Wall& wall) {
    Arrangement all;
    for (const Screen& screen : wall.screens) {
        const ScreenPixels pixels = mosaicPixels(screen);
        all.left[screen.name] = all.width;
        all.width += pixels.width;
        all.height = std::max(all.height, pixels.height);
    }
    return all;
}

/// The eye that the picture shows: the first that any tile has.
Eye chosenEye(const std::vector<Tile>& tiles) {
    Eye eye = Eye::kRight;
    for (const Tile& tile : tiles) eye = std::min(eye, tile.eye);
    return eye;
}

}  // namespace

Expected<Mosaic> stitch(const Wall& wall, const answer::Images& images) {
    if (images.tiles.empty())
        return fail(ErrorCode::kRefused,
                    "no host gave its picture in time: none draws now, or all are at a slow frame; tessera-ctl status "
                    "says which");
    const auto [first, last] = std::minmax_element(images.tiles.begin(), images.tiles.end(),
                                                   [](const auto& a, const auto& b) { return a.frame < b.frame; });
    if (first->frame != last->frame)
        return fail(ErrorCode::kRefused, fmt::format("tile {} shows frame {} and tile {} frame {}; try again",
                                                     first->tile, first->frame.value, last->tile, last->frame.value));
    const std::vector<Tile> tiles = layoutTiles(wall);
    const Eye eye = chosenEye(tiles);
    const Arrangement all = arrange(wall);
    Mosaic mosaic;
    mosaic.frame = first->frame;
    PictureSheet sheet(all.width, all.height, 0);
    for (const Tile& tile : tiles) {
        if (tile.eye != eye) continue;
        const auto image =
            std::find_if(images.tiles.begin(), images.tiles.end(), [&](const auto& i) { return i.tile == tile.name; });
        if (image == images.tiles.end()) {
            mosaic.missing.push_back(tile.name);
            continue;
        }
        const Expected<DecodedPng> png = decodePng(image->png);
        if (!png) return failWith(fmt::format("the image of tile {}", tile.name), png.error());
        if (png->picture.widthPx != tile.mosaicRect.width || png->picture.heightPx != tile.mosaicRect.height)
            return fail(ErrorCode::kBadInput, fmt::format("the image of tile {} is {}x{}, but the tile {}x{}",
                                                          tile.name, png->picture.widthPx, png->picture.heightPx,
                                                          tile.mosaicRect.width, tile.mosaicRect.height));
        // Tiles count from the bottom, pictures from the top.
        const int top = all.height - tile.mosaicRect.y - tile.mosaicRect.height;
        sheet.paste(png->picture, all.left.at(tile.screen) + tile.mosaicRect.x, top);
    }
    mosaic.picture = std::move(sheet).take();
    return mosaic;
}

}  // namespace tessera
