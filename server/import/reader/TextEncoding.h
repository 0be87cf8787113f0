/// Texts that are not in UTF-8.
#pragma once

#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// kBadInput, with the cure, where a text's letters take two bytes each: as Windows' tools write it, with a mark in
/// front. Files of bytes do not begin so and go on with every second byte 0.
[[nodiscard]] inline Expected<void> checkLetters(std::string_view bytes) {
    constexpr std::size_t kLooked = 8;
    const bool little = bytes.starts_with("\xff\xfe"), big = bytes.starts_with("\xfe\xff");
    if ((!little && !big) || bytes.size() < 2 + kLooked) return {};
    for (std::size_t at = 2; at < 2 + kLooked; at += 2)
        if (bytes[at + (little ? 1 : 0)] != '\0' || bytes[at + (little ? 0 : 1)] == '\0') return {};
    return fail(ErrorCode::kBadInput,
                "it is text in UTF-16, which is not read: save it as UTF-8 (iconv -f UTF-16 -t UTF-8)");
}

}  // namespace tessera
