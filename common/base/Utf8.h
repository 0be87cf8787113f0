/// Where text may be cut.
#pragma once

#include <cstddef>
#include <string_view>

namespace tessera {

/// The whole characters of UTF-8 `text` that fit into `maxBytes`. Text that is not UTF-8 is cut as well, somewhere.
[[nodiscard]] inline std::string_view cutUtf8(std::string_view text, std::size_t maxBytes) {
    if (text.size() <= maxBytes) return text;
    std::size_t end = maxBytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
    return text.substr(0, end);
}

}  // namespace tessera
