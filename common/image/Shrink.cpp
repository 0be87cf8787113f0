#include "common/image/Shrink.h"

#include <algorithm>

namespace tessera {
namespace {

/// One pixel of each `count`, by whole numbers: rounded to the nearest.
void meansOf(const std::uint16_t* sums, int rows, const PixelsSeen& pixels, int by, std::uint8_t* out) {
    for (int x = 0; x < pixels.widthPx; x += by) {
        const int columns = std::min(by, pixels.widthPx - x);
        const auto count = static_cast<std::uint32_t>(rows * columns);
        std::uint32_t rgb[3] = {};
        for (int i = 0; i < columns; ++i, sums += pixels.bytesPerPixel)
            for (int c = 0; c < 3; ++c) rgb[c] += sums[c];
        for (const std::uint32_t sum : rgb) *out++ = static_cast<std::uint8_t>((sum + count / 2) / count);
    }
}

}  // namespace

Picture shrunk(const PixelsSeen& pixels, int by) {
    TESSERA_CHECK(by >= 1 && by <= kMostShrink && pixels.widthPx > 0 && pixels.heightPx > 0, "a picture has pixels");
    Picture small{.widthPx = (pixels.widthPx + by - 1) / by, .heightPx = (pixels.heightPx + by - 1) / by, .rgb = {}};
    const std::size_t rowBytes = std::size_t{3} * static_cast<std::size_t>(small.widthPx);
    small.rgb.resize(rowBytes * static_cast<std::size_t>(small.heightPx));
    // Down first, in one sweep of a row that a compiler makes wide; 64 times 255 is in 16 bits.
    std::vector<std::uint16_t> sums(static_cast<std::size_t>(pixels.widthPx) *
                                    static_cast<std::size_t>(pixels.bytesPerPixel));
    for (int y = 0; y < small.heightPx; ++y) {
        const int rows = std::min(by, pixels.heightPx - y * by);
        std::ranges::fill(sums, std::uint16_t{0});
        for (int i = 0; i < rows; ++i) {
            const std::uint8_t* const row = pixels.first + static_cast<std::size_t>(y * by + i) * pixels.pitchBytes;
            for (std::size_t at = 0; at < sums.size(); ++at) sums[at] = static_cast<std::uint16_t>(sums[at] + row[at]);
        }
        meansOf(sums.data(), rows, pixels, by, small.rgb.data() + rowBytes * static_cast<std::size_t>(y));
    }
    return small;
}

Picture shrunk(const Picture& picture, int by) {
    return shrunk({.first = picture.rgb.data(),
                   .pitchBytes = std::size_t{3} * static_cast<std::size_t>(picture.widthPx),
                   .bytesPerPixel = 3,
                   .widthPx = picture.widthPx,
                   .heightPx = picture.heightPx},
                  by);
}

}  // namespace tessera
