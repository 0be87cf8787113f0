/// The lowest level of a crate: numbers at places, and its two ways to press them together.
#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Bytes.h"

namespace tessera {

/// Reads one number after another; beyond the end 0, and `good` says so from then on.
class UsdCrateCursor {
public:
    UsdCrateCursor(ByteSpan bytes, std::uint64_t at) : bytes_(bytes), at_(at), good_(at <= bytes.size()) {}

    template <typename Number>
    [[nodiscard]] Number read() {
        Number number{};
        if (const ByteSpan piece = take(sizeof(Number)); !piece.empty())
            std::memcpy(&number, piece.data(), sizeof(Number));  // little-endian, as this machine
        return number;
    }
    /// Empty where they are not there.
    [[nodiscard]] ByteSpan take(std::uint64_t size) {
        if (size > left()) {
            good_ = false;
            return {};
        }
        const ByteSpan piece = bytes_.subspan(at_, size);
        at_ += size;
        return piece;
    }
    /// A number of things of so many bytes each, at least; 0 and no longer good where there are no bytes for them.
    [[nodiscard]] std::uint64_t count(std::uint64_t bytesEach) {
        const auto said = read<std::uint64_t>();
        if (said <= left() / bytesEach) return said;
        good_ = false;
        return 0;
    }
    void seek(std::uint64_t at) {
        at_ = at;
        good_ = good_ && at <= bytes_.size();
    }
    [[nodiscard]] std::uint64_t at() const { return at_; }
    [[nodiscard]] std::uint64_t left() const { return good_ ? bytes_.size() - at_ : 0; }
    [[nodiscard]] bool good() const { return good_; }
    void spoil() { good_ = false; }

private:
    ByteSpan bytes_;
    std::uint64_t at_ = 0;
    bool good_ = true;
};

/// Blocks of LZ4, as a crate has them: how many, and of several the size of each. `size`: of what comes out, at most.
/// Nothing: they are damaged, or say more than can be in them.
[[nodiscard]] std::optional<Bytes> unpackUsdBlocks(ByteSpan packed, std::uint64_t size);

/// `count` whole numbers of 32 or 64 bits, each as its difference from the one before, in as few bytes as that takes.
/// The cursor stands at their size. Nothing: as above.
template <typename Number>
[[nodiscard]] std::optional<std::vector<Number>> unpackUsdIntegers(UsdCrateCursor& in, std::uint64_t count);

[[nodiscard]] float floatOfHalf(std::uint16_t half);

}  // namespace tessera
