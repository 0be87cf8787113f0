/// The numbers of an ASTC block, of which each has a number of levels that need not be a power of two ("integer
/// sequence encoding"): Khronos Data Format Specification 1.3, sections 23.12 to 23.15.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/import/reader/blocks/AstcBits.h"

namespace tessera {

/// 2^bits levels, three or five times as many with a trit or quint.
struct AstcRange {
    unsigned bits = 0;
    bool trit = false, quint = false;
};

/// By their levels, from 2 to 256. The first twelve are those of weights.
inline constexpr std::array<AstcRange, 21> kAstcRanges = {
    {{1, false, false}, {0, true, false}, {2, false, false}, {0, false, true}, {1, true, false}, {3, false, false},
     {1, false, true},  {2, true, false}, {4, false, false}, {2, false, true}, {3, true, false}, {5, false, false},
     {3, false, true},  {4, true, false}, {6, false, false}, {4, false, true}, {5, true, false}, {7, false, false},
     {5, false, true},  {6, true, false}, {8, false, false}}};

/// How many bits so many numbers take.
[[nodiscard]] unsigned astcSequenceBits(const AstcRange& range, unsigned count);
/// The numbers that `bits` begins with, as many as `values` holds.
void readAstcSequence(AstcBits bits, const AstcRange& range, std::span<std::uint8_t> values);

/// Of the range of this index: a number of a sequence as a colour, 0 to 255, and as a weight, 0 to 64.
[[nodiscard]] std::uint8_t astcColour(std::size_t range, std::uint8_t value);
[[nodiscard]] std::uint8_t astcWeight(std::size_t range, std::uint8_t value);

}  // namespace tessera
