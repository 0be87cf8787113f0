#include "deploy/wall/Stitch.h"

#include <fmt/format.h>

#include <utility>

namespace tessera {

namespace {

/// Frames between displays, and tiles that show nothing: dark, but not the black of a picture.
constexpr std::uint8_t kDark = 14;

}  // namespace

Expected<Stitched> stitch(const PictureLayout& layout, const TileSource& source) {
    Stitched result;
    PictureSheet sheet(layout.widthPx, layout.heightPx, kDark);
    for (const PictureLayout::Place& place : layout.places) {
        const Expected<std::optional<Picture>> image = source(place.tile);
        if (!image) return tl::unexpected(image.error());
        if (!*image) {
            result.missing.push_back(place.tile);
            continue;
        }
        const Picture& picture = **image;
        if (picture.widthPx != place.widthPx || picture.heightPx != place.heightPx) {
            return fail(ErrorCode::kBadInput,
                        fmt::format("the image of tile {} has {} x {} pixels, the tile has {} x {}", place.tile,
                                    picture.widthPx, picture.heightPx, place.widthPx, place.heightPx));
        }
        sheet.paste(picture, place.xPx, place.yPx);
    }
    result.picture = std::move(sheet).take();
    return result;
}

}  // namespace tessera
