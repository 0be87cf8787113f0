/// What texture files (DDS, KTX2) hold, as DecodedImages.
#pragma once

#include <array>
#include <functional>
#include <string>

#include "server/import/reader/ImageDecoder.h"

namespace tessera {

/// How a texel, or a block of 4 × 4, lies in its bytes. Little endian.
struct TexelLayout {
    using Encoding = proto::scene::Image::Encoding;
    /// BC1 …: blocks; else what texels become: SRGB (8 bits a channel) or RGBE (of floats).
    Encoding encoding = proto::scene::Image::SRGB;
    std::size_t bytes = 4;  ///< of a texel or block, 16 at most
    /// Red, green, blue, alpha within a texel's number of 64 bits at most; of no bits: absent. Alone in red and `grey`:
    /// for all three.
    std::array<std::uint64_t, 4> masks{};
    bool grey = false;
    unsigned floatBits = 0, floats = 0;  ///< 16 or 32, and how many: red, green, blue first

    [[nodiscard]] static TexelLayout blocks(Encoding encoding);
    /// Bits from the lowest up of red, green, blue, alpha, one after the other in `order` ("rgba", "bgra", "bgrx"; x:
    /// not used).
    [[nodiscard]] static TexelLayout bits(const std::string& order, const std::array<unsigned, 4>& widths);
    [[nodiscard]] static TexelLayout floating(unsigned bits, unsigned count);
};

/// A texture as its file's header says it.
struct TextureFile {
    const char* kind = "";  ///< "a DDS texture", for messages
    TexelLayout layout;
    std::uint64_t widthPx = 0, heightPx = 1, depthPx = 1, mipmaps = 1;
    proto::scene::Image::Shape shape = proto::scene::Image::FLAT;
    /// The bytes of all slices of a level, of a cube those of one face, `bytes` long. Errors as values.
    std::function<Expected<ByteSpan>(std::uint64_t level, std::uint64_t face, std::uint64_t bytes)> part;
};

/// The levels of a compressed one; of others the largest, converted. kBadInput or kLimit, with the reason, before any
/// memory is taken for bytes that are not there.
[[nodiscard]] Expected<DecodedImage> decodeTexture(const TextureFile& file);

}  // namespace tessera
