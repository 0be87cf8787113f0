/// What texture files (DDS, KTX, KTX2, .astc, .pkm) hold, as DecodedImages.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>

#include "server/import/reader/PictureFormats.h"
#include "server/import/reader/blocks/EtcBlock.h"

namespace tessera {

/// How a texel, or a block of them, lies in its bytes. Little endian.
struct TexelLayout {
    using Encoding = proto::scene::Image::Encoding;
    /// BC1 …: blocks, which stay; else what texels become: SRGB (8 bits a channel) or RGBE (of floats).
    Encoding encoding = proto::scene::Image::SRGB;
    std::size_t bytes = 4;                            ///< of a texel or block, 16 at most
    std::size_t blockWidthPx = 1, blockHeightPx = 1;  ///< 12 at most
    /// Of blocks that become texels: makes one to rows of four bytes a texel. Empty, or why the file is not read.
    std::function<std::string_view(const std::byte* block, std::byte* rgba)> decode;
    /// Red, green, blue, alpha within a texel's number of 64 bits at most; of no bits: absent. Alone in red and `grey`:
    /// for all three.
    std::array<std::uint64_t, 4> masks{};
    bool grey = false;
    unsigned floatBits = 0, floats = 0;  ///< 16 or 32, and how many: red, green, blue first; one for all three

    /// BC1 to BC7.
    [[nodiscard]] static TexelLayout blocks(Encoding encoding);
    [[nodiscard]] static TexelLayout etc(EtcFormat format);
    /// Of ASTC's sizes in two dimensions the one of this index: 0: 4 × 4, 13: 12 × 12.
    [[nodiscard]] static TexelLayout astc(std::size_t size, bool srgb);
    static constexpr std::array<std::array<unsigned, 2>, 14> kAstcSizes = {{{4, 4},
                                                                            {5, 4},
                                                                            {5, 5},
                                                                            {6, 5},
                                                                            {6, 6},
                                                                            {8, 5},
                                                                            {8, 6},
                                                                            {8, 8},
                                                                            {10, 5},
                                                                            {10, 6},
                                                                            {10, 8},
                                                                            {10, 10},
                                                                            {12, 10},
                                                                            {12, 12}}};
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
    bool fromTop = true;  ///< else rows go upwards
    /// The bytes of all slices of a level, of a cube those of one face, `bytes` long. Errors as values.
    std::function<Expected<ByteSpan>(std::uint64_t level, std::uint64_t face, std::uint64_t bytes)> part;

    /// Of all slices of a level, or one face.
    [[nodiscard]] std::uint64_t partBytes(std::uint64_t level) const;
};

/// The levels of one whose blocks stay; of others the largest that is no larger than wanted, converted, or what is
/// halved of the smallest that is. kBadInput or kLimit, with the reason, before any memory is taken for bytes that are
/// not there.
[[nodiscard]] Expected<DecodedImage> decodeTexture(const TextureFile& file, const PictureBounds& bounds);

}  // namespace tessera
