/// Byte buffers. `SharedBytes` is immutable once shared: encode once, hand the same buffer to every connection.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace tessera {

using Bytes = std::vector<std::byte>;
using ByteSpan = std::span<const std::byte>;
using SharedBytes = std::shared_ptr<const Bytes>;

[[nodiscard]] inline SharedBytes share(Bytes bytes) {
    return std::make_shared<const Bytes>(std::move(bytes));
}
[[nodiscard]] inline ByteSpan asBytes(std::string_view text) {
    return std::as_bytes(std::span(text));
}
[[nodiscard]] inline std::string_view asText(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace tessera
