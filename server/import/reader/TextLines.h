/// Lines of texts that tools have written, as words.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace tessera {

class TextLines {
public:
    explicit TextLines(std::string_view text) : rest_(text) {}

    /// The words of the next line that has any; false at the end. In quotes, which stay, blanks part no words.
    bool next(std::vector<std::string_view>& words) {
        do {
            words.clear();
            if (rest_.empty()) return false;
            ++line_;
            const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
            split(rest_.substr(0, end), words);
            const bool both = rest_.substr(end).starts_with("\r\n");
            rest_.remove_prefix(std::min(end + (both ? 2 : 1), rest_.size()));
        } while (words.empty());
        return true;
    }
    [[nodiscard]] std::size_t line() const { return line_; }  ///< of the words, from 1
    [[nodiscard]] std::size_t bytesLeft() const { return rest_.size(); }

private:
    static void split(std::string_view line, std::vector<std::string_view>& words) {
        constexpr std::string_view kBlank = " \t\v\f";
        for (std::size_t at = line.find_first_not_of(kBlank); at != line.npos; at = line.find_first_not_of(kBlank)) {
            line.remove_prefix(at);
            std::size_t end = 0;
            if (line.front() == '"')
                end = std::min(line.find('"', 1), line.size() - 1) + 1;
            else
                end = std::min(line.find_first_of(kBlank), line.size());
            words.push_back(line.substr(0, end));
            line.remove_prefix(end);
        }
    }

    std::string_view rest_;
    std::size_t line_ = 0;
};

/// Whether the word is a number of this type, whole.
template <typename Number>
[[nodiscard]] bool isNumber(std::string_view word, Number& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

/// Whether assimp takes the word for a number, whole: plus signs are good, and a comma where others have a point. What
/// no double can hold is one, too, and `value` stays.
[[nodiscard]] inline bool isReal(std::string_view word, double& value) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    const char* const last = word.data() + word.size();
    const auto [end, error] = std::from_chars(word.data(), last, value);
    if (end == last) return error != std::errc::invalid_argument && !word.empty();
    const std::size_t comma = word.find(',');
    if (comma == word.npos) return false;
    std::string pointed(word);
    pointed[comma] = '.';
    return pointed.find(',') == pointed.npos && isReal(pointed, value);
}

}  // namespace tessera
