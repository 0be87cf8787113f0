/// Which braces of a text in protobuf's text format are open at a place: for messages about those that nobody closed.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tessera {

struct OpenBrace {
    std::string name;  ///< the word before it; empty: there is none
    int line = 0;      ///< from 0
};

/// Those that stand before a place and are not closed there, the outermost first. Lines and columns from 0, as protobuf
/// counts them: a tab leads to the next multiple of eight.
[[nodiscard]] std::vector<OpenBrace> openBraces(std::string_view text, int line, int column);

/// "is the '{' of transform in line 3 closed?"
[[nodiscard]] std::string askForBrace(const OpenBrace& brace);
/// "the file ends here, and the '{' of node in line 1 is not closed"
[[nodiscard]] std::string endsInside(const OpenBrace& brace);

}  // namespace tessera
