/// Blocks of ASTC ("adaptive scalable texture compression") as pixels: Khronos Data Format Specification 1.3, chapter
/// 23, in two dimensions and without a wide range of light (its profile "LDR").
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

/// Sixteen bytes each, of 4 × 4 to 12 × 12 texels.
class AstcDecoder {
public:
    static constexpr std::size_t kBytes = 16;
    enum class Colours : std::uint8_t {
        kLinear,  ///< as numbers of 16 bits, of which the 8 nearest are taken
        kSrgb     ///< as numbers of 8 bits that stand for sRGB's colours
    };
    enum class Kind : std::uint8_t {
        kShown,
        kHdr,      ///< texels of a wide range of light have the specification's error colour, magenta
        kReserved  ///< not of a kind that there is: magenta, all of it
    };

    AstcDecoder(unsigned width, unsigned height, Colours colours) : width_(width), height_(height), colours_(colours) {}
    /// `rgba`: as many texels of four bytes, rows from the top. Any bytes are a block.
    Kind decode(const std::byte* block, std::byte* rgba) const;

private:
    Kind decodeParts(const struct AstcBits& bits, std::byte* rgba) const;
    Kind fill(Kind kind, const std::uint8_t* colour, std::byte* rgba) const;

    unsigned width_, height_;
    Colours colours_;
};

}  // namespace tessera
