/// Numbers of XML's attributes and texts, blanks around them or not.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <system_error>

namespace tessera {

inline std::string_view withoutBlanks(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(kBlanks);
    return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// The next word of what is left, which is shortened by it; empty: there is none.
inline std::string_view nextWord(std::string_view& rest) {
    rest = withoutBlanks(rest);
    const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r\n"));
    rest.remove_prefix(word.size());
    return word;
}

/// NaN: it is no number. Beyond a double's range: infinite, or 0.
inline double numberOf(std::string_view text) {
    text = withoutBlanks(text);
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::invalid_argument || end != text.data() + text.size())
        return std::numeric_limits<double>::quiet_NaN();
    if (error != std::errc::result_out_of_range) return value;
    return text.find("e-") != text.npos || text.find("E-") != text.npos ? 0 : std::numeric_limits<double>::infinity();
}

inline constexpr std::uint32_t kNoNumber = 0xffffffff;

/// A number of an element or a resource; kNoNumber: it is none below 2^31.
inline std::uint32_t indexOf(std::string_view text) {
    text = withoutBlanks(text);
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && value < 0x80000000u ? value : kNoNumber;
}

}  // namespace tessera
