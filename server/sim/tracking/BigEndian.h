/// Numbers of network protocols, the byte of most weight first.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/Bytes.h"

namespace tessera {

/// Takes numbers and texts from the front of bytes, and what is not there as 0, remembered.
class BigEndianReader {
public:
    explicit BigEndianReader(ByteSpan bytes) : bytes_(bytes) {}

    template <std::unsigned_integral Number>
    Number whole() {
        const ByteSpan from = take(sizeof(Number));
        Number value = 0;
        for (const std::byte byte : from) value = static_cast<Number>(value << 8 | std::to_integer<Number>(byte));
        return value;
    }
    std::int32_t int32() { return static_cast<std::int32_t>(whole<std::uint32_t>()); }
    std::int64_t int64() { return static_cast<std::int64_t>(whole<std::uint64_t>()); }
    float float32() { return std::bit_cast<float>(whole<std::uint32_t>()); }
    double float64() { return std::bit_cast<double>(whole<std::uint64_t>()); }
    ByteSpan take(std::size_t count) {
        if (count > bytes_.size()) {
            good_ = false;
            return {};
        }
        const ByteSpan taken = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return taken;
    }

    [[nodiscard]] bool good() const { return good_; }
    [[nodiscard]] std::size_t left() const { return bytes_.size(); }
    [[nodiscard]] ByteSpan rest() const { return bytes_; }

private:
    ByteSpan bytes_;
    bool good_ = true;
};

}  // namespace tessera
