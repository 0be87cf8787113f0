/// Words and lists of USD's text.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <span>
#include <string>
#include <string_view>

#include "common/base/Utf8.h"

namespace tessera {

[[nodiscard]] inline std::string usdIndent(std::size_t depth) {
    return std::string(4 * depth, ' ');
}

/// USD's identifiers: letters, digits, '_', no digit first.
[[nodiscard]] inline std::string usdIdentifier(std::string_view name) {
    std::string plain;
    for (const char c : name) {
        const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        plain += good ? c : '_';
    }
    if (plain.empty()) plain = "node";
    if (plain.front() >= '0' && plain.front() <= '9') plain.insert(0, 1, '_');
    return plain;
}

/// What is no UTF-8 becomes U+FFFD.
[[nodiscard]] inline std::string usdQuoted(std::string_view text) {
    std::string quoted = "\"";
    while (!text.empty()) {
        const std::size_t length = utf8CharacterLength(text);
        const char c = text.front();
        if (length == 0)
            quoted += "\xEF\xBF\xBD";
        else if (c == '"' || c == '\\')
            (quoted += '\\') += c;
        else if (c == '\n' || c == '\r' || c == '\t')
            quoted += c == '\n' ? "\\n" : c == '\r' ? "\\r" : "\\t";
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            quoted += fmt::format("\\x{:02x}", c);
        else
            quoted += text.substr(0, length);
        text.remove_prefix(std::max<std::size_t>(length, 1));
    }
    return quoted += '"';
}

/// "(1, 2, 3)"
template <typename Vector>
[[nodiscard]] std::string usdTuple(const Vector& v) {
    return fmt::format("({})", fmt::join(v.begin(), v.end(), ", "));
}

/// "[(0, 0, 0), …]"; numbers that are none are 0.
[[nodiscard]] inline std::string usdTuples(std::span<const float> values, std::size_t each) {
    std::string text = "[";
    auto to = std::back_inserter(text);
    for (std::size_t i = 0; i + each <= values.size(); i += each) {
        text += i == 0 ? "(" : ", (";
        for (std::size_t k = 0; k < each; ++k)
            fmt::format_to(to, "{}{}", k == 0 ? "" : ", ", std::isfinite(values[i + k]) ? values[i + k] : 0.0f);
        text += ')';
    }
    return text += ']';
}

template <typename Numbers>
[[nodiscard]] std::string usdList(const Numbers& values) {
    return fmt::format("[{}]", fmt::join(values, ", "));
}

}  // namespace tessera
