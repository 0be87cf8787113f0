/// Repeated numbers of a scene file as arrays of a core.
#pragma once

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "common/base/Blob.h"

namespace tessera {

/// None: an empty handle.
template <typename Numbers>
[[nodiscard]] Blob blobOfNumbers(const Numbers& numbers) {
    using Number = std::remove_cvref_t<decltype(*numbers.data())>;
    if (numbers.empty()) return Blob();
    return Blob::of(std::span<const Number>(numbers.data(), static_cast<std::size_t>(numbers.size())));
}

/// 0xRRGGBBAA each, as four bytes.
template <typename Colors>
[[nodiscard]] Blob blobOfColors(const Colors& colors) {
    std::vector<std::uint8_t> bytes;
    for (const std::uint32_t color : colors)
        for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(color >> shift));
    return blobOfNumbers(bytes);
}

}  // namespace tessera
