/// PNG, JPEG and whatever else stb_image reads, to RGBA8; Radiance pictures to RGBE.
#pragma once

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

struct DecodedImage {
    int widthPx = 0, heightPx = 0;
    Bytes rgba;           ///< rows from the top
    bool rgbe = false;    ///< the fourth byte is the exponent of the other three (Image::encoding)
    bool halved = false;  ///< it was larger than allowed and was averaged down
};

/// Averages 2 × 2 pixels; an odd last row or column is dropped.
void halve(DecodedImage& image);

[[nodiscard]] Expected<DecodedImage> decodeImage(ByteSpan encoded, int maxSidePx);

}  // namespace tessera
