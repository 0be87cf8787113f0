/// The two colours between which the texels of an ASTC block, or of a part of one, lie: Khronos Data Format
/// Specification 1.3, sections 23.16 to 23.18, the modes without a wide range of light.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace tessera {

/// Red, green, blue, alpha, each 0 to 255.
struct AstcEndpoints {
    std::array<int, 4> from{}, to{};
};

/// How many numbers the endpoints of a mode (0 to 15) are made of.
[[nodiscard]] constexpr unsigned astcEndpointNumbers(unsigned mode) {
    return 2 * (mode / 4 + 1);
}
/// Of so many numbers, 0 to 255 each. None: the mode is one of HDR's (2, 3, 7, 11, 14, 15).
[[nodiscard]] std::optional<AstcEndpoints> astcEndpoints(unsigned mode, const std::uint8_t* numbers);

}  // namespace tessera
