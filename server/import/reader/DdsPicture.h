/// DirectX's textures (.dds): Microsoft, "DDS file layout" and "Programming guide for DDS"; the numbers of DXGI_FORMAT.
#pragma once

#include "server/import/reader/PictureFormats.h"

namespace tessera {

/// Whether the bytes begin as such a file does.
[[nodiscard]] bool isDds(ByteSpan bytes);
/// bc1 to bc7 as they are, with their mipmaps; pixels of up to 32 bits to RGBA, floats to RGBE. Flat ones, lines,
/// cubes, solids. kBadInput or kLimit, with the reason: damaged, an array of textures, of a format that is none of
/// these (named).
[[nodiscard]] Expected<DecodedImage> decodeDds(ByteSpan bytes, const PictureBounds& bounds);

}  // namespace tessera
