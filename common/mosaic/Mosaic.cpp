#include "common/mosaic/Mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "common/image/PngRows.h"

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

/// What a picture of the wall is put together from.
struct Parts {
    struct Part {
        const answer::TileImageValue* image;
        int x, y, width, height;  ///< pixels from the upper left corner of the whole
    };
    int width = 0, height = 0;
    FrameNumber frame;
    std::vector<Part> parts;
    std::vector<std::string> missing;
};

Expected<Parts> partsOf(const Wall& wall, const answer::Images& images) {
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
    Parts parts{.width = all.width, .height = all.height, .frame = first->frame};
    for (const Tile& tile : tiles) {
        if (tile.eye != eye) continue;
        const auto image =
            std::find_if(images.tiles.begin(), images.tiles.end(), [&](const auto& i) { return i.tile == tile.name; });
        if (image == images.tiles.end()) {
            parts.missing.push_back(tile.name);
            continue;
        }
        // Tiles count from the bottom, pictures from the top.
        parts.parts.push_back({.image = &*image,
                               .x = all.left.at(tile.screen) + tile.mosaicRect.x,
                               .y = all.height - tile.mosaicRect.y - tile.mosaicRect.height,
                               .width = tile.mosaicRect.width,
                               .height = tile.mosaicRect.height});
    }
    return parts;
}

std::string nameOf(const Parts::Part& part) {
    return fmt::format("the image of tile {}", part.image->tile);
}

Expected<void> checkSize(const Parts::Part& part, int width, int height) {
    if (width == part.width && height == part.height) return {};
    return fail(ErrorCode::kBadInput,
                fmt::format("{} is {}x{}, but the tile {}x{}", nameOf(part), width, height, part.width, part.height));
}

}  // namespace

Expected<Mosaic> stitch(const Wall& wall, const answer::Images& images) {
    Expected<Parts> parts = partsOf(wall, images);
    if (!parts) return tl::unexpected(parts.error());
    Mosaic mosaic;
    mosaic.frame = parts->frame;
    mosaic.missing = std::move(parts->missing);
    PictureSheet sheet(parts->width, parts->height, 0);
    for (const Parts::Part& part : parts->parts) {
        // Before it is unpacked: a small file may be of very many pixels.
        const Expected<PngRowReader> head = PngRowReader::open(part.image->png);
        if (!head) return failWith(nameOf(part), head.error());
        const Expected<void> sound = checkSize(part, head->widthPx(), head->heightPx());
        if (!sound) return tl::unexpected(sound.error());
        const Expected<DecodedPng> png = decodePng(part.image->png);
        if (!png) return failWith(nameOf(part), png.error());
        sheet.paste(png->picture, part.x, part.y);
    }
    mosaic.picture = std::move(sheet).take();
    return mosaic;
}

Expected<void> stitchWhole(const Wall& wall, const answer::Images& images, const std::function<void(ByteSpan)>& sink) {
    const Expected<Parts> parts = partsOf(wall, images);
    if (!parts) return tl::unexpected(parts.error());
    struct Open {
        const Parts::Part* part;
        PngRowReader png;
    };
    std::vector<Open> open;
    std::vector<std::uint8_t> row;
    PngRowWriter out(parts->width, parts->height, parts->frame.value, sink);
    for (int y = 0; y < parts->height; ++y) {
        std::erase_if(open, [&](const Open& one) { return one.part->y + one.part->height <= y; });
        for (const Parts::Part& part : parts->parts) {
            if (part.y != y) continue;
            Expected<PngRowReader> png = PngRowReader::open(part.image->png);
            if (!png) return failWith(nameOf(part), png.error());
            const Expected<void> sound = checkSize(part, png->widthPx(), png->heightPx());
            if (!sound) return tl::unexpected(sound.error());
            open.push_back({&part, std::move(*png)});
        }
        row.assign(3 * static_cast<std::size_t>(parts->width), 0);
        for (Open& one : open)
            if (const Expected<void> read = one.png.next(row.data() + 3 * static_cast<std::size_t>(one.part->x)); !read)
                return failWith(nameOf(*one.part), read.error());
        out.row(row.data());
    }
    out.end();
    return {};
}

}  // namespace tessera
