#include "deploy/wall/Stitch.h"

#include <fmt/format.h>

namespace tessera {

namespace {

/// Frames between displays, and tiles that show nothing: dark, but not the black of a picture.
constexpr std::uint8_t kDark = 14;
constexpr std::int64_t kMostPixels = std::int64_t{1} << 28;

}  // namespace

Expected<Stitched> stitch(const PictureLayout& layout, const TileSource& source) {
    if (std::int64_t{layout.widthPx} * layout.heightPx > kMostPixels) {
        return fail(ErrorCode::kLimit,
                    fmt::format("a picture of {} x {} pixels is too large to put together; the tiles are there",
                                layout.widthPx, layout.heightPx));
    }
    Stitched result;
    result.picture = Picture::filled(layout.widthPx, layout.heightPx, kDark, kDark, kDark);
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
        paste(result.picture, picture, place.xPx, place.yPx);
    }
    return result;
}

}  // namespace tessera
