/// Numbers and words of a text, as fast as they come.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <system_error>

namespace tessera {

/// Goes along a line, or a text. Blanks part words; `#` ends a line with remarks.
class TextCursor {
public:
    TextCursor(const char* at, const char* end, bool remarks) : at_(at), end_(end), remarks_(remarks) {}

    /// To the next word; false: there is none.
    bool toWord() {
        while (at_ < end_ && isBlank(*at_)) ++at_;
        return at_ < end_ && !(remarks_ && *at_ == '#');
    }
    /// The word that begins here; empty: none does.
    [[nodiscard]] std::string_view word() {
        const char* const begin = at_;
        while (at_ < end_ && !isBlank(*at_) && !(remarks_ && *at_ == '#')) ++at_;
        return {begin, static_cast<std::size_t>(at_ - begin)};
    }
    /// What is left of the line, without blanks around it.
    [[nodiscard]] std::string_view rest() {
        while (at_ < end_ && isBlank(*at_)) ++at_;
        const char* last = at_;
        for (const char* c = at_; c < end_; ++c)
            if (!isBlank(*c)) last = c + 1;
        const std::string_view text(at_, static_cast<std::size_t>(last - at_));
        at_ = end_;
        return text;
    }
    /// The next word as a number, rounded once. What is too small for a float is 0 or near it. False: it is none, or
    /// none that a float can hold; infinity and NaN are numbers.
    bool number(float& value) {
        if (!toWord()) return false;
        if (*at_ == '+' && at_ + 1 < end_ && at_[1] != '-') ++at_;
        if (shortDecimal(value)) return true;
        const auto [stopped, error] = std::from_chars(at_, end_, value);
        if (error == std::errc::result_out_of_range && !isSmall(stopped, value)) return false;
        if (error == std::errc::invalid_argument) return false;
        at_ = stopped;
        return isAtWordEnd();
    }
    /// The same for a double, but that nothing is too large or too small: that is infinite, or 0.
    bool number(double& value) {
        if (!toWord()) return false;
        if (*at_ == '+' && at_ + 1 < end_ && at_[1] != '-') ++at_;
        const auto [stopped, error] = std::from_chars(at_, end_, value);
        if (error == std::errc::invalid_argument) return false;
        if (error == std::errc::result_out_of_range)
            value = isBelowOne(stopped) ? 0 : std::numeric_limits<double>::infinity();
        at_ = stopped;
        return isAtWordEnd();
    }
    /// Digits, with a sign or without, as far as they go; false: there are none, or more than any file has elements.
    bool digits(std::int64_t& value) {
        const bool isNegative = at_ < end_ && *at_ == '-';
        if (isNegative) ++at_;
        const char* const begin = at_;
        value = 0;
        for (; at_ < end_ && *at_ >= '0' && *at_ <= '9' && at_ - begin < 15; ++at_) value = 10 * value + (*at_ - '0');
        if (isNegative) value = -value;
        return at_ > begin && !(at_ < end_ && *at_ >= '0' && *at_ <= '9');
    }
    /// Whether this comes next; if so, goes past it.
    bool past(char c) {
        const bool comes = at_ < end_ && *at_ == c;
        at_ += comes ? 1 : 0;
        return comes;
    }
    [[nodiscard]] bool isAtWordEnd() const { return at_ == end_ || isBlank(*at_) || (remarks_ && *at_ == '#'); }
    [[nodiscard]] const char* at() const { return at_; }

    /// The first that is no blank, of letters of which the last is none.
    static const char* toLetter(const char* at, const char* end) {
        while (at + 1 < end && isBlank(*at)) ++at;
        return at;
    }
    /// Breaks of lines, too: who wants one line gives one.
    static bool isBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

private:
    /// Digits with a point among them or none, and no more than a float holds exactly: then one division by a power of
    /// ten that a float holds too is rounded once. Clinger, How to read floating point numbers accurately, 1990.
    bool shortDecimal(float& value) {
        constexpr std::array<float, 9> kTens = {1e0f, 1e1f, 1e2f, 1e3f, 1e4f, 1e5f, 1e6f, 1e7f, 1e8f};
        constexpr std::uint32_t kExact = 1 << 24;
        const char* c = at_;
        const bool isNegative = *c == '-';
        if (isNegative) ++c;
        std::uint32_t digits = 0;
        std::size_t count = 0, behindPoint = 0;
        bool isBehindPoint = false;
        for (; c < end_ && !isBlank(*c); ++c) {
            if (*c == '.' && !isBehindPoint) {
                isBehindPoint = true;
            } else if (*c >= '0' && *c <= '9' && ++count < kTens.size()) {
                digits = 10 * digits + static_cast<std::uint32_t>(*c - '0');
                behindPoint += isBehindPoint ? 1 : 0;
            } else {
                return false;
            }
        }
        if (count == 0 || digits > kExact) return false;
        value = static_cast<float>(digits) / kTens[behindPoint];
        if (isNegative) value = -value;
        at_ = c;
        return true;
    }
    /// `at_` to `stopped` is a number out of a float's range.
    bool isSmall(const char* stopped, float& value) const {
        double wide = 0;
        if (std::from_chars(at_, stopped, wide).ec == std::errc()) {
            value = static_cast<float>(wide);
            return std::abs(wide) < 1;
        }
        value = 0;
        return isBelowOne(stopped);
    }
    /// Of a number that no double can hold.
    bool isBelowOne(const char* stopped) const {
        const std::string_view word(at_, static_cast<std::size_t>(stopped - at_));
        const std::size_t exponent = word.find_first_of("eE");
        return exponent != word.npos && word.substr(exponent + 1).starts_with('-');
    }

    const char* at_;
    const char* end_;
    bool remarks_;
};

}  // namespace tessera
