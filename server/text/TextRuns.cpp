#include "server/text/TextRuns.h"

#include <fmt/format.h>
#include <hb.h>

#include <algorithm>
#include <optional>

namespace tessera {
namespace {

struct Decoded {
    char32_t character = 0;
    std::size_t bytes = 0;  ///< 0: none begins here
};

/// RFC 3629: no longer than it has to be, no surrogates, nothing beyond U+10FFFF.
Decoded decodeAt(std::string_view text, std::size_t at) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char lead = byte(at);
    const std::size_t bytes = lead < 0x80 ? 1 : lead >= 0xC2 && lead < 0xE0 ? 2 : lead >= 0xE0 && lead < 0xF0 ? 3 : lead >= 0xF0 && lead < 0xF5 ? 4 : 0;
    if (bytes == 0 || at + bytes > text.size()) return {};
    char32_t character = bytes == 1 ? lead : lead & (0xFFu >> (bytes + 1));
    for (std::size_t i = 1; i < bytes; ++i) {
        if ((byte(at + i) & 0xC0) != 0x80) return {};
        character = character << 6 | (byte(at + i) & 0x3Fu);
    }
    constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    if (character < kLeast[bytes] || character > 0x10FFFF || (character >= 0xD800 && character < 0xE000)) return {};
    return {character, bytes};
}

bool isControl(char32_t c) { return c < 0x20 || (c >= 0x7F && c < 0xA0) || c == 0x2028 || c == 0x2029 || (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069); }

enum class Way : std::uint8_t { kLeftToRight, kRightToLeft, kNumber, kNeither };

Way wayOf(char32_t c) {
    hb_unicode_funcs_t* unicode = hb_unicode_funcs_get_default();
    if (hb_unicode_general_category(unicode, c) == HB_UNICODE_GENERAL_CATEGORY_DECIMAL_NUMBER) return Way::kNumber;
    const hb_script_t script = hb_unicode_script(unicode, c);
    if (script == HB_SCRIPT_COMMON || script == HB_SCRIPT_INHERITED || script == HB_SCRIPT_UNKNOWN) return Way::kNeither;
    return hb_script_get_horizontal_direction(script) == HB_DIRECTION_RTL ? Way::kRightToLeft : Way::kLeftToRight;
}

}  // namespace

Expected<std::vector<std::u32string>> linesOf(std::string_view utf8) {
    std::vector<std::u32string> lines(1);
    for (std::size_t at = 0; at < utf8.size();) {
        const Decoded next = decodeAt(utf8, at);
        if (next.bytes == 0) return fail(ErrorCode::kBadInput, fmt::format("the text is no UTF-8: its byte {} begins no character", at));
        at += next.bytes;
        if (next.character == U'\n') lines.emplace_back();
        else if (next.character == U'\t') lines.back().append(4, U' ');
        else if (!isControl(next.character)) lines.back().push_back(next.character);
    }
    return lines;
}

std::vector<TextRun> runsOf(std::u32string_view line) {
    std::vector<Way> ways;
    for (const char32_t c : line) ways.push_back(wayOf(c));
    const auto first = std::ranges::find_if(ways, [](Way way) { return way == Way::kLeftToRight || way == Way::kRightToLeft; });
    const bool lineRightToLeft = first != ways.end() && *first == Way::kRightToLeft;
    // A number is a letter from left to right, and signs inside it are part of it.
    std::vector<bool> rightToLeft(line.size(), lineRightToLeft);
    bool before = lineRightToLeft;
    for (std::size_t i = 0; i < line.size();) {
        if (ways[i] != Way::kNeither) {
            before = rightToLeft[i] = ways[i] == Way::kRightToLeft;
            ++i;
            continue;
        }
        std::size_t end = i;
        while (end < line.size() && ways[end] == Way::kNeither) ++end;
        const bool after = end < line.size() ? ways[end] == Way::kRightToLeft : lineRightToLeft;
        const bool betweenDigits = end - i == 1 && i > 0 && end < line.size() && ways[i - 1] == Way::kNumber && ways[end] == Way::kNumber;
        for (; i < end; ++i) rightToLeft[i] = betweenDigits ? false : before == after ? before : lineRightToLeft;
    }
    std::vector<TextRun> runs;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (runs.empty() || runs.back().rightToLeft != rightToLeft[i]) runs.push_back({.characters = {}, .rightToLeft = rightToLeft[i]});
        runs.back().characters.push_back(line[i]);
    }
    if (lineRightToLeft) std::ranges::reverse(runs);
    return runs;
}

}  // namespace tessera
