/// Numbers as people write them on a command line.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// -0.17, .5, -.5, +1, 1e-3 are numbers: empty. Else what is wrong: not a number, not a finite one, or too large for
/// one.
[[nodiscard]] std::string numberFault(const std::string& text);
/// The same as a value; kUsage, with `what` in front.
[[nodiscard]] Expected<double> finiteNumber(const std::string& text, std::string_view what);

/// The command line's words with numbers like -.5, and places that begin so, as -0.5: the parser takes what begins with
/// a dash and no digit for an option.
[[nodiscard]] std::vector<std::string> withPlainNumbers(std::vector<std::string> words);

}  // namespace tessera
