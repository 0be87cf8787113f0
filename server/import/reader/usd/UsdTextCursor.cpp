#include "server/import/reader/usd/UsdTextCursor.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace tessera {
namespace {

/// Lists in lists, and dictionaries in dictionaries.
constexpr int kDeepestValue = 32;

bool isNameLetter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           static_cast<unsigned char>(c) >= 0x80;
}

/// Files of old machines end their lines by '\r' alone.
constexpr const char* kLineEnds = "\r\n";

/// Lines that have ended in a text.
std::size_t lineEndsIn(std::string_view text) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < text.size(); ++i)
        if (text[i] == '\n' || (text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n'))) ++count;
    return count;
}

/// As a person may see it in a message.
std::string shown(char c) {
    if (c == '\0') return "the end of the file";
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte >= 0x7f ? fmt::format("byte {:#04x}", byte) : fmt::format("'{}'", c);
}

}  // namespace

std::size_t UsdTextCursor::line() const {
    return 1 + lineEndsIn(text_.substr(0, std::min(at_, text_.size())));
}

bool UsdTextCursor::fault(std::string message, ErrorCode code) {
    if (error_) return false;
    const std::string_view before = text_.substr(0, std::min(at_, text_.size()));
    const std::size_t begin = before.find_last_of(kLineEnds) + 1;  // npos + 1 is 0
    error_ = Error{code, fmt::format("{}:{}: {}", line(), before.size() - begin + 1, message)};
    return false;
}

void UsdTextCursor::skipBlank() {
    while (at_ < text_.size()) {
        const char c = text_[at_];
        if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
            ++at_;
        } else if (c == '#') {
            at_ = std::min(text_.find_first_of(kLineEnds, at_), text_.size());
        } else {
            return;
        }
    }
}

char UsdTextCursor::next() {
    skipBlank();
    return at_ < text_.size() && !error_ ? text_[at_] : '\0';
}

bool UsdTextCursor::accept(char c) {
    if (next() != c || at_ >= text_.size()) return false;
    ++at_;
    return true;
}

bool UsdTextCursor::acceptHere(char c) {
    if (error_ || at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
}

bool UsdTextCursor::expect(char c, std::string_view where) {
    if (accept(c)) return true;
    const char found = next();
    return fault(fmt::format("{} is missing {}; here is {}", shown(c), where, shown(found)));
}

bool UsdTextCursor::acceptWord(std::string_view word) {
    skipBlank();
    const std::string_view rest = text_.substr(std::min(at_, text_.size()));
    if (error_ || !rest.starts_with(word) || (rest.size() > word.size() && isNameLetter(rest[word.size()])))
        return false;
    at_ += word.size();
    return true;
}

bool UsdTextCursor::identifier(std::string_view& name) {
    skipBlank();
    if (error_) return false;
    const std::size_t begin = at_;
    while (at_ < text_.size() && (isNameLetter(text_[at_]) || text_[at_] == ':')) ++at_;
    name = text_.substr(begin, at_ - begin);
    return !name.empty();
}

bool UsdTextCursor::string(std::string& out) {
    out.clear();
    const char quote = next();
    if (quote != '"' && quote != '\'') return fault(fmt::format("a string is missing; here is {}", shown(quote)));
    const bool three = text_.substr(at_).starts_with(std::string(3, quote));
    const std::size_t begin = at_;
    at_ += three ? 3 : 1;
    while (at_ < text_.size()) {
        const char c = text_[at_];
        if (c == quote && (!three || text_.substr(at_).starts_with(std::string(3, quote)))) {
            at_ += three ? 3 : 1;
            return true;
        }
        if ((c == '\n' || c == '\r') && !three) break;
        if (c != '\\' || at_ + 1 >= text_.size()) {
            out += c;
            ++at_;
            continue;
        }
        const char escaped = text_[at_ + 1];
        at_ += 2;
        unsigned code = 0;
        const char* const digits = text_.data() + at_;
        const char* const end = digits + std::min<std::size_t>(2, text_.size() - at_);
        if (const char* const read = std::from_chars(digits, end, code, 16).ptr; escaped == 'x' && read != digits) {
            out += static_cast<char>(code);
            at_ += static_cast<std::size_t>(read - digits);
        } else {
            out += escaped == 'n' ? '\n' : escaped == 't' ? '\t' : escaped == 'r' ? '\r' : escaped;
        }
    }
    at_ = begin;
    return fault("this string has no end");
}

bool UsdTextCursor::asset(std::string& out) {
    if (next() != '@') return fault(fmt::format("an @asset@ is missing; here is {}", shown(next())));
    const std::string_view mark = text_.substr(at_).starts_with("@@@") ? "@@@" : "@";
    const std::size_t begin = at_ + mark.size();
    const std::size_t end = text_.find(mark, begin);
    if (end == std::string_view::npos ||
        (mark.size() == 1 && text_.substr(begin, end - begin).find_first_of(kLineEnds) != text_.npos))
        return fault("this @asset@ has no end");
    out = text_.substr(begin, end - begin);
    at_ = end + mark.size();
    return true;
}

bool UsdTextCursor::path(std::string& out) {
    if (!expect('<', "before a path")) return false;
    const std::size_t end = text_.find_first_of(">\r\n", at_);
    if (end == std::string_view::npos || text_[end] != '>') return fault("this <path> has no end");
    out = text_.substr(at_, end - at_);
    at_ = end + 1;
    return true;
}

bool UsdTextCursor::number(double& out) {
    skipBlank();
    if (error_) return false;
    if (at_ < text_.size() && text_[at_] == '+') ++at_;
    const char* const begin = text_.data() + std::min(at_, text_.size());
    const auto [end, problem] = std::from_chars(begin, text_.data() + text_.size(), out);
    if (problem == std::errc::result_out_of_range)  // 1e-400 is 0, 1e400 infinite
        out = std::strtod(std::string(begin, end).c_str(), nullptr);
    else if (problem != std::errc())
        return fault(fmt::format("a number is missing; here is {}", shown(next())));
    at_ += static_cast<std::size_t>(end - begin);
    return true;
}

bool UsdTextCursor::skipBrackets() {
    const std::size_t begin = at_;
    std::size_t depth = 0;
    std::string ignored;
    do {
        const char c = next();
        if (c == '\0') {
            if (!error_) at_ = begin;
            return fault("this bracket is never closed");
        }
        if (c == '"' || c == '\'') {
            if (!string(ignored)) return false;
        } else if (c == '@') {
            if (!asset(ignored)) return false;
        } else {
            if (c == '(' || c == '[' || c == '{') ++depth;
            if (c == ')' || c == ']' || c == '}') --depth;
            ++at_;
        }
    } while (depth > 0);
    return true;
}

// ---- values ---------------------------------------------------------------------------------------------------------

template <typename Number>
bool UsdTextCursor::element(std::vector<Number>& out, int depth) {
    if (accept('(')) {
        if (depth >= kDeepestValue) return fault("these brackets are nested too deep", ErrorCode::kLimit);
        while (!accept(')')) {
            if (!element(out, depth + 1)) return false;
            if (!accept(',') && next() != ')') return fault(fmt::format("')' is missing; here is {}", shown(next())));
        }
        return true;
    }
    double number = 0;
    if (acceptWord("true"))
        number = 1;
    else if (!acceptWord("false") && !this->number(number))
        return false;
    if constexpr (std::is_same_v<Number, std::int32_t>) {
        if (!(number >= std::numeric_limits<std::int32_t>::min() && number <= std::numeric_limits<std::int32_t>::max()))
            return fault(fmt::format("{} is no whole number of 32 bits", number));
    }
    out.push_back(static_cast<Number>(number));
    return true;
}

template <typename Number>
bool UsdTextCursor::numbers(const UsdType& type, const std::string& typeName, UsdValue& out) {
    std::vector<Number> all;
    const auto one = [&] {
        const std::size_t before = all.size();
        if (!element(all, 0)) return false;
        if (all.size() - before != type.width)
            return fault(
                fmt::format("{} numbers end here, where {} has {}", all.size() - before, typeName, type.width));
        if (type.quaternion) std::rotate(all.end() - 4, all.end() - 3, all.end());
        return true;
    };
    if (type.array) {
        if (!expect('[', fmt::format("before the values of {}", typeName))) return false;
        while (!accept(']')) {
            if (!one()) return false;
            if (!accept(',') && next() != ']') return fault(fmt::format("']' is missing; here is {}", shown(next())));
        }
    } else if (!one()) {
        return false;
    }
    out.width = type.width;
    out.array = type.array;
    out.data = std::move(all);
    return true;
}

bool UsdTextCursor::word(std::string& out) {
    const char c = next();
    if (c == '"' || c == '\'') return string(out);
    if (c == '@') return asset(out);
    if (c == '<') return path(out);
    std::string_view name;
    if (!identifier(name)) return fault(fmt::format("a value is missing; here is {}", shown(c)));
    out = name;
    return true;
}

bool UsdTextCursor::words(UsdValue& out) {
    UsdValue::Words all;
    out.array = accept('[');
    if (!out.array) {
        if (!word(all.emplace_back())) return false;
    } else {
        while (!accept(']')) {
            if (!word(all.emplace_back())) return false;
            if (!accept(',') && next() != ']') return fault(fmt::format("']' is missing; here is {}", shown(next())));
        }
    }
    out.data = std::move(all);
    return true;
}

bool UsdTextCursor::value(const UsdType& type, const std::string& typeName, UsdValue& out) {
    if (acceptWord("None") || acceptWord("AnimationBlock")) {
        out.data = std::monostate();
        return true;
    }
    switch (type.store) {
        case UsdType::Store::kIntegers:
            return numbers<std::int32_t>(type, typeName, out);
        case UsdType::Store::kFloats:
            return numbers<float>(type, typeName, out);
        case UsdType::Store::kDoubles:
            return numbers<double>(type, typeName, out);
        default:
            return anyValue(out);
    }
}

bool UsdTextCursor::anyValue(UsdValue& out, int depth) {
    if (depth >= kDeepestValue) return fault("these brackets are nested too deep", ErrorCode::kLimit);
    if (acceptWord("None") || acceptWord("AnimationBlock")) {
        out.data = std::monostate();
        return true;
    }
    const char c = next();
    if (c == '{') return dictionary(out, depth + 1);
    const auto isNumber = [](char first) {
        return (first >= '0' && first <= '9') || first == '-' || first == '+' || first == '.' || first == '(';
    };
    if (c == '[') {
        const std::size_t begin = at_++;
        const char first = next();
        at_ = begin;
        if (!isNumber(first)) return words(out);
    } else if (acceptWord("true") || acceptWord("false")) {
        out.data = std::vector<std::int32_t>{c == 't' ? 1 : 0};
        return true;
    } else if (!isNumber(c)) {
        return words(out);
    }
    std::vector<double> all;
    out.array = accept('[');
    if (!out.array) {
        if (!element(all, 0)) return false;
        out.width = static_cast<std::uint32_t>(std::max<std::size_t>(all.size(), 1));
    } else {
        while (!accept(']')) {
            const std::size_t before = all.size();
            if (!element(all, 0)) return false;
            if (before == 0) out.width = static_cast<std::uint32_t>(std::max<std::size_t>(all.size(), 1));
            if (all.size() - before != out.width) return fault("values of different sizes stand in one list");
            if (!accept(',') && next() != ']') return fault(fmt::format("']' is missing; here is {}", shown(next())));
        }
    }
    out.data = std::move(all);
    return true;
}

bool UsdTextCursor::dictionary(UsdValue& out, int depth) {
    if (depth >= kDeepestValue) return fault("these brackets are nested too deep", ErrorCode::kLimit);
    if (!expect('{', "before a dictionary")) return false;
    auto held = std::make_shared<UsdValue::Dictionary>();
    while (!accept('}')) {
        std::string key, type;
        std::string_view name;
        if (next() == '"' || next() == '\'') return fault("the type of this entry is missing");
        if (!identifier(name)) return fault(fmt::format("a type is missing; here is {}", shown(next())));
        type = name;
        if (acceptHere('[') && !expect(']', "behind the type of a list")) return false;
        if (text_[at_ - 1] == ']') type += "[]";
        if (next() == '"' || next() == '\'') {
            if (!string(key)) return false;
        } else if (identifier(name)) {
            key = name;
        } else {
            return fault(fmt::format("a name is missing; here is {}", shown(next())));
        }
        if (!expect('=', "behind a name")) return false;
        UsdValue inner;
        if (type == "dictionary" ? !dictionary(inner, depth + 1) : !value(usdTypeOf(type), type, inner)) return false;
        held->insert_or_assign(std::move(key), std::move(inner));
        while (accept(';') || accept(',')) {
        }
    }
    out.data = std::shared_ptr<const UsdValue::Dictionary>(std::move(held));
    return true;
}

}  // namespace tessera
