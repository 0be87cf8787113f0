/// Khronos' textures (.ktx2): KTX File Format Specification 2.0; the numbers of VkFormat.
#pragma once

#include "server/import/reader/PictureFormats.h"

namespace tessera {

[[nodiscard]] bool isKtx2(ByteSpan bytes);
/// As decodeDds, plain or compressed by zstd; ETC, EAC and ASTC become pixels. BasisLZ, UASTC and zlib are refused by
/// name.
[[nodiscard]] Expected<DecodedImage> decodeKtx2(ByteSpan bytes, const PictureBounds& bounds);

}  // namespace tessera
