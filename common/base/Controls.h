/// Characters that are not seen themselves, and change how what stands around them is.
#pragma once

#include <cstddef>
#include <string_view>

#include "common/base/Utf8.h"

namespace tessera {

/// The number of a well-formed character of UTF-8, which is not empty.
[[nodiscard]] inline char32_t numberOfCharacter(std::string_view character) {
    const auto first = static_cast<unsigned char>(character[0]);
    if (character.size() == 1) return first;
    auto number = static_cast<char32_t>(first & (0x7F >> character.size()));
    for (std::size_t i = 1; i < character.size(); ++i)
        number = number << 6 | (static_cast<unsigned char>(character[i]) & 0x3F);
    return number;
}

/// Commands to terminals (C0, DEL, C1), ends of lines, turns of the direction of text, and what has no width. Where one
/// person is told what another has said, these could make it look like something else.
[[nodiscard]] constexpr bool isControl(char32_t number) {
    const auto within = [number](char32_t first, char32_t last) { return number >= first && number <= last; };
    return number < 0x20 || within(0x7F, 0x9F) || number == 0x61C || within(0x200B, 0x200F) || within(0x2028, 0x202E) ||
           within(0x2066, 0x2069) || number == 0xFEFF;
}

}  // namespace tessera
