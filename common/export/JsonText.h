/// JSON as it is written for files of others, piece by piece: numbers as the shortest that read back the same.
#pragma once

#include <fmt/format.h>

#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/base/Utf8.h"

namespace tessera {

/// In quotes. What is no UTF-8 becomes U+FFFD.
[[nodiscard]] inline std::string jsonQuoted(std::string_view text) {
    std::string quoted = "\"";
    while (!text.empty()) {
        const std::size_t length = utf8CharacterLength(text);
        const auto first = static_cast<unsigned char>(text.front());
        if (length == 0)
            quoted += "\xEF\xBF\xBD";
        else if (first == '"' || first == '\\')
            (quoted += '\\') += text.front();
        else if (first < 0x20 || first == 0x7F)
            quoted += fmt::format("\\u{:04x}", first);
        else
            quoted += text.substr(0, length);
        text.remove_prefix(std::max<std::size_t>(length, 1));
    }
    return quoted += '"';
}

/// Of finite numbers.
template <typename Numbers>
[[nodiscard]] std::string jsonNumbers(const Numbers& numbers) {
    return fmt::format("[{}]", fmt::join(numbers, ","));
}

/// Members in the order in which they are added.
class JsonObject {
public:
    JsonObject& text(std::string_view key, std::string_view value) { return json(key, jsonQuoted(value)); }
    template <typename Number>
    requires std::is_arithmetic_v<Number> JsonObject& number(std::string_view key, Number value) {
        return json(key, fmt::format("{}", value));
    }
    template <typename Numbers>
    JsonObject& numbers(std::string_view key, const Numbers& values) {
        return json(key, jsonNumbers(values));
    }
    /// What is JSON already.
    JsonObject& json(std::string_view key, std::string_view value) {
        text_ += text_.empty() ? '{' : ',';
        ((text_ += jsonQuoted(key)) += ':') += value;
        return *this;
    }
    [[nodiscard]] bool empty() const { return text_.empty(); }
    [[nodiscard]] std::string done() const { return text_.empty() ? "{}" : text_ + '}'; }

private:
    std::string text_;
};

/// Elements one after the other; `add` says the place of the one added.
class JsonArray {
public:
    int add(std::string_view value) {
        text_ += text_.empty() ? '[' : ',';
        text_ += value;
        return count_++;
    }
    [[nodiscard]] int size() const { return count_; }
    [[nodiscard]] std::string done() const { return text_.empty() ? "[]" : text_ + ']'; }

private:
    std::string text_;
    int count_ = 0;
};

}  // namespace tessera
