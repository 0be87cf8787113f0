/// Khronos' first textures (.ktx): KTX File Format Specification 1; the numbers of OpenGL and its extensions.
#pragma once

#include "server/import/reader/PictureFormats.h"

namespace tessera {

[[nodiscard]] bool isKtx1(ByteSpan bytes);
/// As decodeDds, of either order of bytes; ETC, EAC and ASTC become pixels.
[[nodiscard]] Expected<DecodedImage> decodeKtx1(ByteSpan bytes, const PictureBounds& bounds);

}  // namespace tessera
