#include "server/text/TextRuns.h"

#include <fmt/format.h>
#include <fribidi.h>
#include <hb.h>

#include <algorithm>
#include <numeric>

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
    const std::size_t bytes = lead < 0x80                   ? 1
                              : lead >= 0xC2 && lead < 0xE0 ? 2
                              : lead >= 0xE0 && lead < 0xF0 ? 3
                              : lead >= 0xF0 && lead < 0xF5 ? 4
                                                            : 0;
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

/// But for those that say directions: runsOf follows them, and shapers show nothing for them.
bool isControl(char32_t c) {
    return c < 0x20 || (c >= 0x7F && c < 0xA0) || c == 0x2028 || c == 0x2029;
}

/// A bracket that is open: what closes it, and the script that it has.
struct OpenBracket {
    hb_codepoint_t closing = 0;
    hb_script_t script = HB_SCRIPT_COMMON;
};

/// Of each character that of a letter: blanks, signs and marks have that of what is before them, else of the first
/// letter, and a bracket that of the one that opens it (Unicode's annex 24, 5.1 and 5.2). Common where there is no
/// letter.
std::vector<hb_script_t> scriptsOf(std::u32string_view line) {
    hb_unicode_funcs_t* const unicode = hb_unicode_funcs_get_default();
    std::vector<hb_script_t> scripts;
    std::vector<OpenBracket> open;
    hb_script_t last = HB_SCRIPT_COMMON;
    for (const char32_t c : line) {
        const hb_script_t own = hb_unicode_script(unicode, c);
        const hb_unicode_general_category_t category = hb_unicode_general_category(unicode, c);
        const hb_codepoint_t mirrored = hb_unicode_mirroring(unicode, c);
        if (own != HB_SCRIPT_COMMON && own != HB_SCRIPT_INHERITED && own != HB_SCRIPT_UNKNOWN) {
            if (last == HB_SCRIPT_COMMON) {
                std::ranges::fill(scripts, own);
                for (OpenBracket& bracket : open) bracket.script = own;
            }
            last = own;
        } else if (mirrored != c && (category == HB_UNICODE_GENERAL_CATEGORY_OPEN_PUNCTUATION ||
                                     category == HB_UNICODE_GENERAL_CATEGORY_INITIAL_PUNCTUATION)) {
            open.push_back({.closing = mirrored, .script = last});
        } else if (mirrored != c && (category == HB_UNICODE_GENERAL_CATEGORY_CLOSE_PUNCTUATION ||
                                     category == HB_UNICODE_GENERAL_CATEGORY_FINAL_PUNCTUATION)) {
            const auto opened = std::find_if(open.rbegin(), open.rend(),
                                             [&](const OpenBracket& bracket) { return bracket.closing == c; });
            if (opened != open.rend()) {
                last = opened->script;
                open.erase(opened.base() - 1, open.end());
            }
        }
        scripts.push_back(last);
    }
    return scripts;
}

/// A line by Unicode's annex 9: the level of each character, and which of them stands where, from left to right.
struct Levels {
    std::vector<FriBidiLevel> of;
    std::vector<FriBidiStrIndex> standing;
};

Levels levelsOf(std::u32string_view line) {
    const auto length = static_cast<FriBidiStrIndex>(line.size());
    const std::vector<FriBidiChar> characters(line.begin(), line.end());
    std::vector<FriBidiCharType> types(line.size());
    std::vector<FriBidiBracketType> brackets(line.size());
    Levels levels{std::vector<FriBidiLevel>(line.size()), std::vector<FriBidiStrIndex>(line.size())};
    std::iota(levels.standing.begin(), levels.standing.end(), 0);
    fribidi_get_bidi_types(characters.data(), length, types.data());
    fribidi_get_bracket_types(characters.data(), length, types.data(), brackets.data());
    FriBidiParType lineWay = FRIBIDI_PAR_ON;  // as its first letter
    const bool placed =
        fribidi_get_par_embedding_levels_ex(types.data(), brackets.data(), length, &lineWay, levels.of.data()) != 0 &&
        fribidi_reorder_line(0, types.data(), length, 0, lineWay, levels.of.data(), nullptr, levels.standing.data()) !=
            0;
    TESSERA_CHECK(placed, "levels of a line: there is no memory");  // nothing else fails
    return levels;
}

}  // namespace

Expected<std::vector<std::u32string>> linesOf(std::string_view utf8) {
    std::vector<std::u32string> lines(1);
    for (std::size_t at = 0; at < utf8.size();) {
        const Decoded next = decodeAt(utf8, at);
        if (next.bytes == 0)
            return fail(ErrorCode::kBadInput, fmt::format("the text is no UTF-8: its byte {} begins no character", at));
        at += next.bytes;
        if (next.character == U'\n')
            lines.emplace_back();
        else if (next.character == U'\t')
            lines.back().append(4, U' ');
        else if (!isControl(next.character))
            lines.back().push_back(next.character);
    }
    return lines;
}

std::vector<TextRun> runsOf(std::u32string_view line) {
    if (line.empty()) return {};
    const std::vector<hb_script_t> scripts = scriptsOf(line);
    const Levels levels = levelsOf(line);
    std::vector<TextRun> runs;
    FriBidiLevel before = 0;
    for (const FriBidiStrIndex standing : levels.standing) {
        const auto at = static_cast<std::size_t>(standing);
        const FriBidiLevel level = levels.of[at];
        const bool rightToLeft = level % 2 != 0;
        TextRun* const last = runs.empty() ? nullptr : &runs.back();
        const bool goesOn = last != nullptr && level == before &&
                            static_cast<std::uint32_t>(scripts[at]) == last->script &&
                            (rightToLeft ? at + 1 == last->begin : at == last->begin + last->length);
        if (!goesOn)
            runs.push_back({.begin = at,
                            .length = 0,
                            .rightToLeft = rightToLeft,
                            .script = static_cast<std::uint32_t>(scripts[at])});
        runs.back().begin = std::min(runs.back().begin, at);
        ++runs.back().length;
        before = level;
    }
    return runs;
}

}  // namespace tessera
