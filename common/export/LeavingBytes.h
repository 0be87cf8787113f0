/// Bytes that nobody else keeps, as slices.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/ByteSlice.h"

namespace tessera {

template <typename T>
[[nodiscard]] ByteSlice sliceOf(std::vector<T> values) {
    const auto owner = std::make_shared<const std::vector<T>>(std::move(values));
    return {owner, std::as_bytes(std::span(*owner))};
}

[[nodiscard]] inline ByteSlice sliceOfText(std::string text) {
    const auto owner = std::make_shared<const std::string>(std::move(text));
    return {owner, asBytes(*owner)};
}

}  // namespace tessera
