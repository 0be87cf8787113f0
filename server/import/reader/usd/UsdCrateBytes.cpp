#include "server/import/reader/usd/UsdCrateBytes.h"

#include <lz4.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <type_traits>

namespace tessera {
namespace {

/// What a byte of LZ4 can become, at most.
constexpr std::uint64_t kMostUnpacked = 255;
constexpr std::uint64_t kLargestBlock = LZ4_MAX_INPUT_SIZE;

/// How far it came; nothing: it is damaged.
std::optional<std::size_t> unpackBlock(ByteSpan packed, std::byte* to, std::uint64_t room) {
    const auto most = static_cast<int>(std::min<std::uint64_t>(room, kLargestBlock));
    if (packed.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return std::nullopt;
    const int made = LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(to),
                                         static_cast<int>(packed.size()), most);
    if (made < 0) return std::nullopt;
    return static_cast<std::size_t>(made);
}

}  // namespace

std::optional<Bytes> unpackUsdBlocks(ByteSpan packed, std::uint64_t size) {
    if (packed.empty() || size > packed.size() * kMostUnpacked + kMostUnpacked) return std::nullopt;
    Bytes out(size + 1);  // so that there is a place to write to where nothing is said
    UsdCrateCursor in(packed, 0);
    const auto blocks = std::to_integer<unsigned>(in.take(1)[0]);
    std::size_t done = 0;
    for (unsigned i = 0; i < std::max(blocks, 1U); ++i) {
        const std::uint64_t bytes = blocks == 0 ? in.left() : static_cast<std::uint32_t>(in.read<std::int32_t>());
        const ByteSpan block = in.take(bytes);
        if (!in.good()) return std::nullopt;
        const std::optional<std::size_t> made = unpackBlock(block, out.data() + done, size - done);
        if (!made) return std::nullopt;
        done += *made;
    }
    out.resize(done);
    return out;
}

template <typename Number>
std::optional<std::vector<Number>> unpackUsdIntegers(UsdCrateCursor& in, std::uint64_t count) {
    using Signed = std::make_signed_t<Number>;
    using Unsigned = std::make_unsigned_t<Number>;
    const std::uint64_t packedBytes = in.count(1);
    const ByteSpan packed = in.take(packedBytes);
    if (count == 0) return std::vector<Number>();
    // Two bits each at least.
    if (!in.good() || count / 4 > (packed.size() + 1) * kMostUnpacked) return std::nullopt;
    const std::uint64_t codeBytes = (count * 2 + 7) / 8;
    const std::optional<Bytes> bytes = unpackUsdBlocks(
        packed, std::min(sizeof(Number) + codeBytes + count * sizeof(Number), (packed.size() + 1) * kMostUnpacked));
    if (!bytes || bytes->size() < sizeof(Number) + codeBytes) return std::nullopt;
    UsdCrateCursor numbers(*bytes, 0);
    const auto common = numbers.read<Signed>();
    const ByteSpan codes = numbers.take(codeBytes);
    std::vector<Number> out;
    out.reserve(count);
    Unsigned value = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
        const auto code = (std::to_integer<unsigned>(codes[i / 4]) >> (i % 4 * 2)) & 3U;
        Signed step = common;
        if constexpr (sizeof(Number) == 4) {
            if (code == 1) step = numbers.read<std::int8_t>();
            if (code == 2) step = numbers.read<std::int16_t>();
            if (code == 3) step = numbers.read<std::int32_t>();
        } else {
            if (code == 1) step = numbers.read<std::int16_t>();
            if (code == 2) step = numbers.read<std::int32_t>();
            if (code == 3) step = numbers.read<std::int64_t>();
        }
        value += static_cast<Unsigned>(step);  // wraps, as whoever wrote them counted
        out.push_back(static_cast<Number>(value));
    }
    if (!numbers.good()) return std::nullopt;
    return out;
}
template std::optional<std::vector<std::int32_t>> unpackUsdIntegers(UsdCrateCursor&, std::uint64_t);
template std::optional<std::vector<std::uint32_t>> unpackUsdIntegers(UsdCrateCursor&, std::uint64_t);
template std::optional<std::vector<std::int64_t>> unpackUsdIntegers(UsdCrateCursor&, std::uint64_t);
template std::optional<std::vector<std::uint64_t>> unpackUsdIntegers(UsdCrateCursor&, std::uint64_t);

/// IEEE 754's binary16.
float floatOfHalf(std::uint16_t half) {
    const std::uint32_t sign = (half & 0x8000U) << 16, exponent = (half >> 10) & 0x1fU, mantissa = half & 0x3ffU;
    if (exponent == 0) {
        const float small = static_cast<float>(mantissa) * 0x1p-24F;
        return sign != 0 ? -small : small;
    }
    const std::uint32_t wide = exponent == 31 ? 255 : exponent + 112;
    return std::bit_cast<float>(sign | (wide << 23) | (mantissa << 13));
}

}  // namespace tessera
