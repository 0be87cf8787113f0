/// Formats of pictures that stb_image does not read, or not all of: PNM (Netpbm), SGI's, TIFF, WebP.
#pragma once

#include "server/import/reader/ImageDecoder.h"

namespace tessera {

/// A picture to be decoded is at most as large, a side and in all: what is halved later may be larger than what is
/// kept.
inline constexpr std::size_t kMaxPictureSide = 32768, kMaxPicturePixels = std::size_t{1} << 27;

/// P1 to P6, of 8 or 16 bits. Netpbm's manual pages pbm(5), pgm(5), ppm(5). kBadInput, with the reason, as of those
/// below.
[[nodiscard]] bool isPnm(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodePnm(ByteSpan bytes);

/// Silicon Graphics' (.sgi, .rgb, .rgba, .bw): "The SGI image file format", version 1.00. 8 or 16 bits, plain or in
/// runs, 1 to 4 channels.
[[nodiscard]] bool isSgi(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeSgi(ByteSpan bytes);

/// By libtiff, the first page, as it shows pictures: 8 bits a channel, upright.
[[nodiscard]] bool isTiff(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeTiff(ByteSpan bytes);

/// By libwebp; of an animation its first picture.
[[nodiscard]] bool isWebp(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeWebp(ByteSpan bytes);

}  // namespace tessera
