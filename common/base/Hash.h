/// Content hashes (XXH3). Fast, not cryptographic: they find damage, not forgery.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <string>

#include "common/base/Bytes.h"

namespace tessera {

struct Hash128 {
    std::uint64_t low = 0;
    std::uint64_t high = 0;

    constexpr auto operator<=>(const Hash128&) const = default;
    /// All zero means "nothing".
    [[nodiscard]] constexpr explicit operator bool() const { return (low | high) != 0; }
};

[[nodiscard]] std::uint64_t hash64(ByteSpan bytes, std::uint64_t seed = 0);
[[nodiscard]] Hash128 hash128(ByteSpan bytes);
/// 16 or 32 lower-case hexadecimal digits.
[[nodiscard]] std::string toHex(std::uint64_t value);
[[nodiscard]] std::string toHex(const Hash128& hash);

}  // namespace tessera

template <>
struct std::hash<tessera::Hash128> {
    std::size_t operator()(const tessera::Hash128& h) const noexcept {
        return h.low ^ (h.high * 0x9E3779B97F4A7C15ull);
    }
};
