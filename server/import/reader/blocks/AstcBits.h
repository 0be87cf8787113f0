/// The 128 bits of an ASTC block.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace tessera {

/// Bit 0 is the lowest of the first byte. Beyond bit 127 all are zero.
struct AstcBits {
    std::uint64_t low = 0, high = 0;

    [[nodiscard]] static AstcBits of(const std::byte* block) {
        static_assert(std::endian::native == std::endian::little);
        AstcBits bits;
        std::memcpy(&bits.low, block, 8);
        std::memcpy(&bits.high, block + 8, 8);
        return bits;
    }
    /// `count` bits from `at` on, `count` at most 32, as a number.
    [[nodiscard]] unsigned number(unsigned at, unsigned count) const {
        return static_cast<unsigned>(from(at).low & ((std::uint64_t{1} << count) - 1));
    }
    /// `count` bits from `at` on, behind them zeros.
    [[nodiscard]] AstcBits part(unsigned at, unsigned count) const {
        AstcBits bits = from(at);
        bits.low &= lowest(count);
        bits.high &= count > 64 ? lowest(count - 64) : 0;
        return bits;
    }
    /// The last bit first: so weights lie.
    [[nodiscard]] AstcBits reversed() const { return {mirrored(high), mirrored(low)}; }

private:
    [[nodiscard]] AstcBits from(unsigned at) const {
        if (at == 0) return *this;
        if (at >= 128) return {};
        if (at >= 64) return {high >> (at - 64), 0};
        return {low >> at | high << (64 - at), high >> at};
    }
    static std::uint64_t lowest(unsigned count) {
        return count >= 64 ? ~std::uint64_t{} : (std::uint64_t{1} << count) - 1;
    }
    static std::uint64_t mirrored(std::uint64_t bits) {
        bits = (bits >> 1 & 0x5555555555555555) | (bits & 0x5555555555555555) << 1;
        bits = (bits >> 2 & 0x3333333333333333) | (bits & 0x3333333333333333) << 2;
        bits = (bits >> 4 & 0x0f0f0f0f0f0f0f0f) | (bits & 0x0f0f0f0f0f0f0f0f) << 4;
        return __builtin_bswap64(bits);
    }
};

}  // namespace tessera
