/// Text as lines, and lines as runs of one direction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// By '\n'. A tab is four spaces; other control characters are left out, but for those that say directions. Refused
/// where it is no UTF-8: the byte is named.
[[nodiscard]] Expected<std::vector<std::u32string>> linesOf(std::string_view utf8);

/// What a shaper takes at once: letters of one level and one script.
struct TextRun {
    std::size_t begin = 0, length = 0;  ///< of the line, in the order in which it is read
    bool rightToLeft = false;
    std::uint32_t script = 0;  ///< ISO 15924's four letters, as HarfBuzz has them
};

/// From left to right as they stand, by Unicode's annex 9: the line runs as its first letter does, whatever is quoted
/// in it by its own letters, brackets and marks of direction. Runs end where scripts do, too.
[[nodiscard]] std::vector<TextRun> runsOf(std::u32string_view line);

}  // namespace tessera
