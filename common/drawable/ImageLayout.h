/// How the pixels of an Image lie in its bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/Error.h"
#include "common/cores/ShippedTypes.h"

namespace tessera {

/// A mipmap: all its slices or faces one after the other, each rows from the top; of compressed ones rows of blocks.
struct ImageLevel {
    std::int64_t widthPx = 1, heightPx = 1;
    std::int64_t depthPx = 1;      ///< of a solid its slices; of a cube 6
    std::uint64_t offset = 0;      ///< in the bytes
    std::uint64_t sizeBytes = 0;   ///< of all slices or faces
    std::uint64_t sliceBytes = 0;  ///< of one
};

/// bc1 to bc7: blocks of 4 × 4 pixels.
[[nodiscard]] bool isCompressed(std::int64_t encoding);
/// Of such a block: 8 or 16; of what is not compressed, of a pixel: 4.
[[nodiscard]] std::uint64_t unitBytes(std::int64_t encoding);
/// Down to one pixel, the full size included.
[[nodiscard]] std::int64_t mostMipmaps(const Image& image);
/// Those that `pixels` holds, of an image that checkImage lets pass; the largest first.
[[nodiscard]] std::vector<ImageLevel> levelsOf(const Image& image);

/// kBadInput, in words: sides, shape, encoding or mipmaps that do not fit each other, or bytes that are not as many as
/// they need. An image without any bytes passes whatever it says: it shows nothing. Looks at no pixel; any thread.
[[nodiscard]] Expected<void> checkImage(const Image& image);

/// Whether no pixel of an image that checkImage lets pass lets anything through; its bytes are here. Of bc7 and bc3 by
/// the ends of each block: one that could let through and happens not to counts as one that does.
[[nodiscard]] bool isOpaque(const Image& image);

}  // namespace tessera
