/// Hashes as people and programs write them.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

#include "common/base/Hash.h"

namespace tessera {

/// Of 32 hexadecimal digits, as `toHex` writes them.
[[nodiscard]] inline std::optional<Hash128> hashOfText(std::string_view text) {
    constexpr std::size_t kDigits = 16;
    if (text.size() != 2 * kDigits) return std::nullopt;
    Hash128 hash;
    const auto half = [&](std::size_t from, std::uint64_t& number) {
        const char* const end = text.data() + from + kDigits;
        const auto [stopped, error] = std::from_chars(text.data() + from, end, number, 16);
        return error == std::errc() && stopped == end;
    };
    if (!half(0, hash.high) || !half(kDigits, hash.low)) return std::nullopt;
    return hash;
}

}  // namespace tessera
