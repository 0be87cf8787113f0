/// The tokens of a saved text, one after the other, and what they say together. Internal to this folder.
#pragma once

#include <fmt/format.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/OpenBraces.h"
#include "common/base/Utf8.h"
#include "common/scene/Aspect.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/SceneSchema.h"

namespace tessera {

class TextTokens : google::protobuf::io::ErrorCollector {
protected:
    using Tokenizer = google::protobuf::io::Tokenizer;

    struct Place {
        int line = 0, column = 0;  ///< from 1
    };
    struct Open {
        std::string name;
        int line;
        const SceneSchema::Type* type;  ///< null: no object
    };

    TextTokens(std::string_view text, const SavedPart& part)
        : part_(part),
          input_(text.data() + part.begin, static_cast<int>(part.end - part.begin)),
          tokens_(&input_, this) {
        tokens_.set_comment_style(Tokenizer::SH_COMMENT_STYLE);
        tokens_.set_allow_f_after_float(true);
        tokens_.set_require_space_after_number(false);
    }
    ~TextTokens() override = default;

    /// Nodes, and what stands in the innermost.
    static constexpr std::size_t kSpareDepth = 16;

    [[nodiscard]] int line() { return tokens_.current().line + part_.line; }
    [[nodiscard]] int column() { return tokens_.current().column + (tokens_.current().line == 0 ? part_.column : 0); }
    [[nodiscard]] Place here() { return {line() + 1, column() + 1}; }
    [[nodiscard]] tl::unexpected<Error> failHere(std::string_view why, ErrorCode code = ErrorCode::kBadInput) {
        return failAt(here(), why, code);
    }
    [[nodiscard]] static tl::unexpected<Error> failAt(const Place& at, std::string_view why,
                                                      ErrorCode code = ErrorCode::kBadInput) {
        return fail(code, fmt::format("{}:{}: {}", at.line, at.column, why));
    }
    void AddError(int line, google::protobuf::io::ColumnNumber column, const std::string& message) override {
        if (!broken_.empty()) return;
        std::string_view words = message;
        while (words.ends_with('.')) words.remove_suffix(1);
        broken_ = fmt::format("{}:{}: {}", line + part_.line + 1, column + (line == 0 ? part_.column : 0) + 1, words);
    }
    /// What stands here, for messages.
    [[nodiscard]] std::string shown() {
        constexpr std::size_t kMost = 40;
        const std::string& text = tokens_.current().text;
        if (!isUtf8(text)) return "bytes that are no UTF-8";
        return text.size() > kMost ? std::string(cutUtf8(text, kMost)) + "…" : text;
    }
    Expected<void> next() {
        tokens_.Next();
        if (!broken_.empty()) return fail(ErrorCode::kBadInput, broken_);
        return {};
    }
    [[nodiscard]] bool isSymbol(char c) {
        return tokens_.current().type == Tokenizer::TYPE_SYMBOL && tokens_.current().text[0] == c;
    }
    [[nodiscard]] bool isText() { return tokens_.current().type == Tokenizer::TYPE_STRING; }
    /// Takes the symbol where it stands there.
    Expected<bool> takes(char c) {
        if (!isSymbol(c)) return false;
        if (Expected<void> good = next(); !good) return tl::unexpected(good.error());
        return true;
    }
    Expected<void> expect(char c, std::string_view after) {
        if (isSymbol(c)) return next();
        if (tokens_.current().type == Tokenizer::TYPE_END && !open_.empty())
            return failHere(endsInside({open_.back().name, open_.back().line}));
        return failHere(fmt::format("expected '{}' after {}, not '{}'", c, after, shown()));
    }

    /// `{ … }`, whose inside is fields. The one that is open is the last of `open_` already.
    template <typename Field>
    Expected<void> insideBraces(Field&& field) {
        if (open_.size() > SceneLimits().maxDepth + kSpareDepth)
            return failHere(fmt::format("it is nested deeper than {} levels", SceneLimits().maxDepth + kSpareDepth),
                            ErrorCode::kLimit);
        if (Expected<void> good = expect('{', open_.back().name); !good) return good;
        while (!isSymbol('}')) {
            if (tokens_.current().type == Tokenizer::TYPE_END)
                return failHere(endsInside({open_.back().name, open_.back().line}));
            if (tokens_.current().type != Tokenizer::TYPE_IDENTIFIER)
                return failHere(fmt::format("expected a word, not '{}'", shown()));
            if (Expected<void> good = field(); !good) return good;
            if (isSymbol(',') || isSymbol(';'))
                if (Expected<void> good = next(); !good) return good;
        }
        open_.pop_back();
        // What follows the last brace of all is not of this part.
        return open_.empty() ? Expected<void>() : next();
    }

    Expected<std::string> text(std::string_view word) {
        if (!isText()) return failHere(fmt::format("{} is a text in quotes", word));
        std::string value;
        while (isText()) {
            Tokenizer::ParseStringAppend(tokens_.current().text, &value);
            if (Expected<void> good = next(); !good) return tl::unexpected(good.error());
        }
        return value;
    }

    template <typename T>
    Expected<T> number(std::string_view word) {
        const Place at = here();
        const Expected<bool> minus = takes('-');
        if (!minus) return tl::unexpected(minus.error());
        const Tokenizer::Token& token = tokens_.current();
        std::string_view digits = token.text;
        T value{};
        bool good = false;
        std::uint64_t whole = 0;
        if constexpr (std::is_floating_point_v<T>) {
            if (token.type == Tokenizer::TYPE_IDENTIFIER) {
                good = digits == "inf" || digits == "infinity" || digits == "nan";
                value = digits == "nan" ? std::numeric_limits<T>::quiet_NaN() : std::numeric_limits<T>::infinity();
            } else if (token.type == Tokenizer::TYPE_FLOAT || token.type == Tokenizer::TYPE_INTEGER) {
                const bool isPlain = token.type == Tokenizer::TYPE_FLOAT || digits == "0" || digits[0] != '0';
                if (digits.ends_with('f') && isPlain) digits.remove_suffix(1);
                if (isPlain) {
                    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
                    good = error == std::errc() && end == digits.data() + digits.size();
                    if (error == std::errc::result_out_of_range) good = outOfRange(std::string(digits), value);
                } else if (Tokenizer::ParseInteger(token.text, std::numeric_limits<std::uint64_t>::max(), &whole)) {
                    value = static_cast<T>(whole);
                    good = true;
                }
            }
            if (*minus) value = -value;
        } else {
            const std::uint64_t most =
                *minus && std::is_signed_v<T>
                    ? static_cast<std::uint64_t>(std::numeric_limits<std::make_signed_t<T>>::max()) + 1
                    : static_cast<std::uint64_t>(std::numeric_limits<T>::max());
            good = token.type == Tokenizer::TYPE_INTEGER && Tokenizer::ParseInteger(token.text, most, &whole) &&
                   (!*minus || std::is_signed_v<T>);
            value = *minus ? static_cast<T>(0 - whole) : static_cast<T>(whole);
        }
        if (!good)
            return failAt(at, fmt::format("{} cannot be '{}{}': expected {}", word, *minus ? "-" : "", shown(),
                                          std::is_floating_point_v<T> ? "a number" : "a whole number in its bounds"));
        if (Expected<void> further = next(); !further) return tl::unexpected(further.error());
        return value;
    }
    /// What is too large is infinite, and refused by who knows the field; what is too small is 0 or nearly so.
    template <typename T>
    static bool outOfRange(const std::string& digits, T& value) {
        value = static_cast<T>(std::strtold(digits.c_str(), nullptr));
        return true;
    }

    /// One value, or several in brackets.
    template <typename One>
    Expected<void> list(std::string_view word, One&& one) {
        const Expected<bool> many = takes('[');
        if (!many) return tl::unexpected(many.error());
        if (!*many) return one();
        while (!isSymbol(']')) {
            if (tokens_.current().type == Tokenizer::TYPE_END)
                return failHere(fmt::format("the file ends here, and the '[' of {} is not closed", word));
            if (Expected<void> good = one(); !good) return good;
            if (isSymbol(']')) break;
            if (Expected<void> good = expect(',', fmt::format("a value of {}", word)); !good) return good;
        }
        return next();
    }

    const SavedPart& part_;
    google::protobuf::io::ArrayInputStream input_;
    Tokenizer tokens_;
    std::string broken_;
    std::vector<Open> open_;
};

}  // namespace tessera
