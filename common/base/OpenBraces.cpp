#include "common/base/OpenBraces.h"

#include <fmt/format.h>

namespace tessera {
namespace {

bool isWordCharacter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
}

std::string braceOf(const OpenBrace& brace) {
    return fmt::format("the '{{'{}{} in line {}", brace.name.empty() ? "" : " of ", brace.name, brace.line + 1);
}

}  // namespace

std::vector<OpenBrace> openBraces(std::string_view text, int line, int column) {
    constexpr std::size_t kMostOpen = 10'000;  // no reader goes so deep
    std::vector<OpenBrace> open;
    std::string_view word;
    int atLine = 0, atColumn = 0;
    char quote = 0;  // inside a text, what ends it
    bool comment = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (atLine > line || (atLine == line && atColumn >= column)) break;
        const char c = text[i];
        if (c == '\n') {
            ++atLine;
            atColumn = 0;
            comment = false;
            quote = 0;
            continue;
        }
        atColumn += c == '\t' ? 8 - atColumn % 8 : 1;
        if (comment) continue;
        if (quote != 0) {
            if (c == '\\' && i + 1 < text.size() && text[i + 1] != '\n') {
                ++i;
                ++atColumn;
            } else if (c == quote) {
                quote = 0;
            }
            continue;
        }
        if (c == '#') {
            comment = true;
        } else if (c == '"' || c == '\'') {
            quote = c;
            word = {};
        } else if (c == '{' || c == '<') {
            if (open.size() < kMostOpen) open.push_back({std::string(word), atLine});
            word = {};
        } else if (c == '}' || c == '>') {
            if (!open.empty()) open.pop_back();
            word = {};
        } else if (isWordCharacter(c)) {
            const bool goesOn = !word.empty() && word.data() + word.size() == text.data() + i;
            word = goesOn ? text.substr(i - word.size(), word.size() + 1) : text.substr(i, 1);
        }
    }
    return open;
}

std::string askForBrace(const OpenBrace& brace) {
    return fmt::format("is {} closed?", braceOf(brace));
}

std::string endsInside(const OpenBrace& brace) {
    return fmt::format("the file ends here, and {} is not closed", braceOf(brace));
}

}  // namespace tessera
