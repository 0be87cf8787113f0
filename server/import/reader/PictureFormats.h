/// Formats of pictures that stb_image does not read, or not all of.
#pragma once

#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/PixelPool.h"

namespace tessera {

/// A picture to be decoded is at most as large, a side and in all: what is halved later may be larger than what is
/// kept.
inline constexpr std::size_t kMaxPictureSide = 32768, kMaxPicturePixels = std::size_t{1} << 27;

struct PictureBounds {
    int maxSidePx;  ///< what is larger is halved later, or while it is decoded
    PixelPool& pool;

    /// Before anything is done for so many pixels. kBadInput: no picture has them. kLimit: the pool has not. `what`: "a
    /// TIFF picture". `weight`: whose memory and time each takes.
    [[nodiscard]] Expected<void> allow(std::string_view what, std::size_t widthPx, std::size_t heightPx,
                                       unsigned weight = 1) const;
};

/// By libpng.
[[nodiscard]] bool isPng(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodePng(ByteSpan bytes, const PictureBounds& bounds);

/// P1 to P6, of 8 or 16 bits. Netpbm's manual pages pbm(5), pgm(5), ppm(5). kBadInput or kLimit, with the reason, as
/// of those below.
[[nodiscard]] bool isPnm(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodePnm(ByteSpan bytes, const PictureBounds& bounds);

/// Silicon Graphics' (.sgi, .rgb, .rgba, .bw): "The SGI image file format", version 1.00. 8 or 16 bits, plain or in
/// runs, 1 to 4 channels.
[[nodiscard]] bool isSgi(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeSgi(ByteSpan bytes, const PictureBounds& bounds);

/// By libtiff, the first page, as it shows pictures: 8 bits a channel, upright.
[[nodiscard]] bool isTiff(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeTiff(ByteSpan bytes, const PictureBounds& bounds);

/// By libwebp; of an animation its first picture.
[[nodiscard]] bool isWebp(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeWebp(ByteSpan bytes, const PictureBounds& bounds);

/// By OpenEXR, to RGBE, of the first part that has colours. Its channels without a layer are shown, else those of the
/// layer "Combined", else those of the first layer that has some: R, G, B, or light (Y), with or without colours of
/// half the size (RY, BY). The display window is shown, black where nothing is stored. Opacity, and primaries other
/// than Rec. 709's, are not regarded. Deep pixels are refused by name. kLimit too: no memory is left.
[[nodiscard]] bool isExr(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeExr(ByteSpan bytes, const PictureBounds& bounds);

/// Blocks as encoders write them, in files of their own: astcenc's .astc (read as sRGB: no file says what its colours
/// are), etcpack's and others' .pkm (ETC1, ETC2, EAC). kLimit too, as of `decodeTexture`.
[[nodiscard]] bool isAstcFile(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodeAstcFile(ByteSpan bytes, const PictureBounds& bounds);
[[nodiscard]] bool isPkm(ByteSpan bytes);
[[nodiscard]] Expected<DecodedImage> decodePkm(ByteSpan bytes, const PictureBounds& bounds);

}  // namespace tessera
