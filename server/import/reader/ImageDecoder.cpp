#include "server/import/reader/ImageDecoder.h"

#include <tiny_gltf.h>

#include "server/import/reader/RadiancePicture.h"

#include <cstring>
#include <limits>

namespace tessera {

void halve(DecodedImage& image) {
    const int width = std::max(1, image.widthPx / 2), height = std::max(1, image.heightPx / 2);
    Bytes small(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
    const auto at = [&](int x, int y, int channel) {
        const std::size_t column = static_cast<std::size_t>(std::min(x, image.widthPx - 1));
        const std::size_t row = static_cast<std::size_t>(std::min(y, image.heightPx - 1));
        const std::size_t index =
            (row * static_cast<std::size_t>(image.widthPx) + column) * 4 + static_cast<std::size_t>(channel);
        return std::to_integer<unsigned>(image.rgba[index]);
    };
    std::size_t out = 0;
    // Of exponents there is no mean: that of what they say.
    for (int y = 0; image.rgbe && y < height; ++y)
        for (int x = 0; x < width; ++x, out += 4) {
            double sum[3] = {};
            for (const auto& [dx, dy] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{0, 1}, std::pair{1, 1}}) {
                const std::size_t column = static_cast<std::size_t>(std::min(2 * x + dx, image.widthPx - 1));
                const std::size_t row = static_cast<std::size_t>(std::min(2 * y + dy, image.heightPx - 1));
                double rgb[3];
                rgbeToLinear(&image.rgba[(row * static_cast<std::size_t>(image.widthPx) + column) * 4], rgb);
                for (int c = 0; c < 3; ++c) sum[c] += 0.25 * rgb[c];
            }
            linearToRgbe(sum, &small[out]);
        }
    for (int y = 0; !image.rgbe && y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int channel = 0; channel < 4; ++channel) {
                const unsigned sum = at(2 * x, 2 * y, channel) + at(2 * x + 1, 2 * y, channel) +
                                     at(2 * x, 2 * y + 1, channel) + at(2 * x + 1, 2 * y + 1, channel);
                small[out++] = static_cast<std::byte>((sum + 2) / 4);
            }
    image.widthPx = width;
    image.heightPx = height;
    image.rgba = std::move(small);
    image.halved = true;
}

Expected<DecodedImage> decodeImage(ByteSpan encoded, int maxSidePx) {
    if (encoded.empty() || encoded.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
        return fail(ErrorCode::kBadInput, "an empty or enormous image");
    if (isRadiancePicture(encoded)) {
        Expected<DecodedImage> image = decodeRadiance(encoded);
        while (image && (image->widthPx > maxSidePx || image->heightPx > maxSidePx)) halve(*image);
        return image;
    }
    // stb_image is at hand in tinygltf's library; its loader is the one call that is exported under a stable name.
    tinygltf::Image loaded;
    std::string error, warning;
    const bool done = tinygltf::LoadImageData(&loaded, 0, &error, &warning, 0, 0,
                                              reinterpret_cast<const unsigned char*>(encoded.data()),
                                              static_cast<int>(encoded.size()), nullptr);
    const std::size_t pixels =
        static_cast<std::size_t>(std::max(loaded.width, 0)) * static_cast<std::size_t>(std::max(loaded.height, 0));
    const std::size_t bytesPerChannel = loaded.bits == 16 ? 2 : 1;
    if (!done || pixels == 0 || loaded.component != 4 || loaded.image.size() < pixels * 4 * bytesPerChannel)
        return fail(ErrorCode::kBadInput, "an image that cannot be decoded (PNG, JPEG and Radiance's .hdr can)");
    DecodedImage image;
    image.widthPx = loaded.width;
    image.heightPx = loaded.height;
    image.rgba.resize(pixels * 4);
    if (bytesPerChannel == 1)
        std::memcpy(image.rgba.data(), loaded.image.data(), image.rgba.size());
    else  // little endian: the upper byte is the second
        for (std::size_t i = 0; i < image.rgba.size(); ++i)
            image.rgba[i] = static_cast<std::byte>(loaded.image[2 * i + 1]);
    while (image.widthPx > maxSidePx || image.heightPx > maxSidePx) halve(image);
    return image;
}

}  // namespace tessera
