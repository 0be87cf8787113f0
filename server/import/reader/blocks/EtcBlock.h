/// Blocks of ETC1, ETC2 and EAC ("Ericsson texture compression") as pixels: Khronos Data Format Specification 1.3,
/// chapters 21 and 22.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

enum class EtcFormat : std::uint8_t {
    kRgb,        ///< ETC2's, and ETC1's, which are among these
    kRgbCutOut,  ///< texels are opaque, or of no colour and clear
    kRgba,       ///< of 16 bytes: EAC's alpha, ETC2's colours
    kRed,        ///< EAC's: 11 bits, of which the 8 nearest are taken; grey
    kRedGreen,   ///< of 16 bytes
    kSignedRed,  ///< -1 to 1, which become 0 to 255
    kSignedRedGreen
};

[[nodiscard]] constexpr std::size_t etcBlockBytes(EtcFormat format) {
    return format == EtcFormat::kRgba || format == EtcFormat::kRedGreen || format == EtcFormat::kSignedRedGreen ? 16
                                                                                                                : 8;
}
/// `rgba`: 4 × 4 texels of four bytes, rows from the top. Any bytes are a block.
void decodeEtcBlock(EtcFormat format, const std::byte* block, std::byte* rgba);

}  // namespace tessera
