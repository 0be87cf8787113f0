/// What long-lived programs say on standard output.
#pragma once

#include <cstdio>
#include <string_view>

namespace tessera {

/// Goes on where nobody reads it any more: fmt::print would throw.
inline void printText(std::string_view text) {
    (void)std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace tessera
