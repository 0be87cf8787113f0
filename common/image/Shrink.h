/// Smaller pictures, for those who look from afar.
#pragma once

#include "common/image/Picture.h"

namespace tessera {

/// Where pixels lie: `bytesPerPixel` 3 or 4, of which red, green and blue (sRGB) are the first; rows from the top.
struct PixelsSeen {
    const std::uint8_t* first = nullptr;
    std::size_t pitchBytes = 0;  ///< from one row to the next
    int bytesPerPixel = 3;
    int widthPx = 0, heightPx = 0;
};

inline constexpr int kMostShrink = 64;

/// Each pixel is the mean of `by` × `by`, from 1 to kMostShrink; at the right and lower edge of those that are there.
[[nodiscard]] Picture shrunk(const PixelsSeen& pixels, int by);
[[nodiscard]] Picture shrunk(const Picture& picture, int by);

}  // namespace tessera
