/// Text as lines, and lines as runs of one direction.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// By '\n'. A tab is four spaces; other control characters are left out. Refused where it is no UTF-8: the byte is named.
[[nodiscard]] Expected<std::vector<std::u32string>> linesOf(std::string_view utf8);

struct TextRun {
    std::u32string characters;  ///< in the order in which they are read
    bool rightToLeft = false;
};

/// From left to right as they stand. The line runs as its first letter does; numbers run from left to right anywhere; blanks and signs go with what is on both sides of
/// them, else with the line. (Unicode's annex 9 without its levels: what is quoted in what is quoted stands as its own letters say.)
[[nodiscard]] std::vector<TextRun> runsOf(std::u32string_view line);

}  // namespace tessera
