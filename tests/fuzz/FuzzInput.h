/// What fuzz targets share: the bytes of an input as numbers, and a way to end where a promise is broken.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "common/base/Bytes.h"

/// One input: bytes in, nothing out. Whatever is wrong ends the process.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace tessera::fuzz {

/// A promise that holds whatever the bytes are.
inline void must(bool holds, const char* promise) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", promise);
    std::abort();
}

/// Reads an input from its beginning. At its end everything is zero.
class FuzzInput {
public:
    FuzzInput(const std::uint8_t* data, std::size_t size) : at_(data), left_(size) {}

    [[nodiscard]] bool empty() const { return left_ == 0; }
    [[nodiscard]] std::size_t left() const { return left_; }
    template <typename Number>
    [[nodiscard]] Number number() {
        Number value{};
        const std::size_t count = std::min(sizeof(Number), left_);
        if (count > 0) std::memcpy(&value, at_, count);
        skip(count);
        return value;
    }
    /// 0 … count-1; a byte or two.
    [[nodiscard]] std::size_t below(std::size_t count) {
        if (count <= 1) return 0;
        return (count <= 256 ? number<std::uint8_t>() : number<std::uint16_t>()) % count;
    }
    /// At most so many of the next bytes.
    [[nodiscard]] ByteSpan bytes(std::size_t most) {
        const ByteSpan some(reinterpret_cast<const std::byte*>(at_), std::min(most, left_));
        skip(some.size());
        return some;
    }
    [[nodiscard]] ByteSpan rest() { return bytes(left_); }

private:
    void skip(std::size_t count) {
        at_ += count;
        left_ -= count;
    }
    const std::uint8_t* at_;
    std::size_t left_;
};

}  // namespace tessera::fuzz
