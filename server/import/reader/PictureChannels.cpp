#include "server/import/reader/PictureChannels.h"

#include <algorithm>

namespace tessera {

Expected<DecodedImage> joinedChannels(std::vector<PictureChannel> channels) {
    DecodedImage joined;
    for (const PictureChannel& channel : channels) {
        const DecodedImage& picture = channel.picture;
        if (picture.encoding != proto::scene::Image::SRGB || picture.shape != proto::scene::Image::FLAT)
            return fail(ErrorCode::kBadInput,
                        "it is compressed, or no flat picture, and cannot be joined with another");
        joined.widthPx = std::max(joined.widthPx, picture.widthPx);
        joined.heightPx = std::max(joined.heightPx, picture.heightPx);
        joined.halved = joined.halved || picture.halved;
    }
    const auto width = static_cast<std::size_t>(joined.widthPx), height = static_cast<std::size_t>(joined.heightPx);
    joined.rgba.assign(width * height * 4, std::byte{255});
    for (const PictureChannel& channel : channels) {
        const DecodedImage& picture = channel.picture;
        const auto fromWidth = static_cast<std::size_t>(picture.widthPx),
                   fromHeight = static_cast<std::size_t>(picture.heightPx);
        const auto from = static_cast<std::size_t>(channel.from), to = static_cast<std::size_t>(channel.to);
        for (std::size_t y = 0; y < height; ++y)
            for (std::size_t x = 0; x < width; ++x)
                joined.rgba[4 * (y * width + x) + to] =
                    picture.rgba[4 * (y * fromHeight / height * fromWidth + x * fromWidth / width) + from];
    }
    return joined;
}

}  // namespace tessera
