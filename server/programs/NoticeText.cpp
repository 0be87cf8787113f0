#include "server/programs/NoticeText.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tessera {
namespace {

struct Letter {
    char32_t code = 0;
    std::size_t size = 1;  ///< in bytes
};
/// The first character of UTF-8 `text`, which is not empty; '?' for a byte that begins none.
Letter firstLetter(std::string_view text) {
    const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
    const unsigned lead = byte(0);
    const std::size_t size = lead < 0x80                   ? 1
                             : lead >= 0xc2 && lead < 0xe0 ? 2
                             : lead >= 0xe0 && lead < 0xf0 ? 3
                             : lead >= 0xf0 && lead < 0xf5 ? 4
                                                           : 0;
    if (size == 1) return {lead, 1};
    if (size == 0) return {U'?', 1};
    char32_t code = lead & (0x7fu >> size);
    for (std::size_t i = 1; i < size; ++i) {
        if ((byte(i) & 0xc0u) != 0x80u) return {U'?', 1};
        code = code << 6 | (byte(i) & 0x3fu);
    }
    constexpr std::array<char32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
    const bool none = code < kLeast[size] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000);
    return none ? Letter{U'?', 1} : Letter{code, size};
}

/// Neither a letter nor a sign: control characters, what turns the direction of others, ends of lines.
bool isBlank(char32_t c) {
    return c <= 0x20 || (c >= 0x7f && c <= 0xa0) || c == 0xad || c == 0x61c || (c >= 0x200b && c <= 0x200f) ||
           (c >= 0x2028 && c <= 0x202f) || (c >= 0x2060 && c <= 0x206f) || c == 0xfeff ||
           (c >= 0xfff0 && c <= 0xfffb) || c >= 0xe0000;
}

/// Of what stands in one word, or is cut.
std::size_t widthOf(char32_t c) {
    return c >= 0x2e80 ? 2 : 1;
}

void appendUtf8(std::string& out, char32_t c) {
    const auto put = [&](char32_t byte) { out.push_back(static_cast<char>(static_cast<unsigned char>(byte))); };
    if (c < 0x80) return put(c);
    if (c < 0x800) return put(0xc0 | c >> 6), put(0x80 | (c & 0x3f));
    if (c < 0x10000) return put(0xe0 | c >> 12), put(0x80 | (c >> 6 & 0x3f)), put(0x80 | (c & 0x3f));
    put(0xf0 | c >> 18), put(0x80 | (c >> 12 & 0x3f)), put(0x80 | (c >> 6 & 0x3f)), put(0x80 | (c & 0x3f));
}

/// Letters, with single blanks between words and none at the ends.
std::u32string lettersOf(std::string_view text) {
    std::u32string letters;
    while (!text.empty()) {
        const Letter letter = firstLetter(text);
        text.remove_prefix(letter.size);
        if (!isBlank(letter.code))
            letters.push_back(letter.code);
        else if (!letters.empty() && letters.back() != U' ')
            letters.push_back(U' ');
    }
    if (!letters.empty() && letters.back() == U' ') letters.pop_back();
    return letters;
}

std::size_t columnsOf(std::u32string_view letters) {
    std::size_t columns = 0;
    for (const char32_t c : letters) columns += widthOf(c);
    return columns;
}

/// As much of `letters` as fits into a line, and as ends where a word does if one does in its second half; takes it
/// away.
std::u32string_view takeLine(std::u32string_view& letters) {
    std::size_t end = 0, columns = 0;
    while (end < letters.size() && columns + widthOf(letters[end]) <= NoticeText::kColumns)
        columns += widthOf(letters[end++]);
    if (end < letters.size()) {
        const std::size_t blank = letters.substr(0, end + 1).rfind(U' ');
        if (blank != std::u32string_view::npos && blank > end / 2) end = blank;
    }
    const std::u32string_view line = letters.substr(0, end);
    letters.remove_prefix(end);
    if (!letters.empty() && letters.front() == U' ') letters.remove_prefix(1);
    return line;
}

}  // namespace

NoticeText noticeText(std::string_view path, ObjectId object, std::string_view problem, std::string_view type) {
    std::u32string head = lettersOf(path);
    const std::u32string number = lettersOf(fmt::format(": {} #{}", type, object.value));
    // Of a long path the end says more.
    if (const std::size_t room = NoticeText::kColumns - number.size(); head.size() > room) {
        std::u32string end(1, U'…');
        end.append(head, head.size() - room + 1, room);
        head.swap(end);
    }
    head += number;
    const std::u32string letters = lettersOf(problem.empty() ? std::string_view("it is bad") : problem);
    std::vector<std::u32string> lines{head};
    std::u32string_view rest = letters;
    while (!rest.empty() && lines.size() + 1 < NoticeText::kMostLines) lines.emplace_back(takeLine(rest));
    // Either the last line, or how much there is beside.
    if (columnsOf(rest) <= NoticeText::kColumns) {
        if (!rest.empty()) lines.emplace_back(rest);
    } else {
        lines.push_back(
            lettersOf(fmt::format("… and {} letters more: tessera-ctl get #{}", rest.size(), object.value)));
    }
    NoticeText notice{.text = {}, .lines = lines.size(), .columns = 0};
    for (const std::u32string& line : lines) {
        if (!notice.text.empty()) notice.text.push_back('\n');
        for (const char32_t c : line) appendUtf8(notice.text, c);
        notice.columns = std::max(notice.columns, columnsOf(line));
    }
    return notice;
}

}  // namespace tessera
