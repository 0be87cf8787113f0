// Where a text has its saved part.

#include <fmt/format.h>

#include <algorithm>

#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/TextForm.h"

namespace tessera {
namespace {

/// Steps over what stands at the top of a text.
class TopScanner {
public:
    explicit TopScanner(std::string_view text) : text_(text) {}

    /// The next word at the top, with its place; nothing: the text is over. What is in braces is passed over.
    std::optional<SavedPart> word() {
        while (skipBlank()) {
            const char c = text_[at_];
            if (isWordCharacter(c)) return takeWord();
            step();
            if (c == '"' || c == '\'') skipText(c);
            if (c == '{' || c == '<' || c == '[') skipBraces();
        }
        return std::nullopt;
    }
    /// Whether what follows is the inside of a message, as a person writes it.
    bool beginsNested() {
        if (!opensBrace()) return false;
        step();
        if (!skipBlank()) return false;
        if (text_[at_] == '}') return true;  // a person deleted all that was there
        if (!isWordCharacter(text_[at_])) return false;
        const SavedPart part = takeWord();
        const std::string_view first = text_.substr(part.begin, part.end - part.begin);
        if (first == "object" || first.starts_with("later")) return false;
        return first != textform::kRoot || opensBrace();
    }
    void skipBraces() {
        for (std::size_t depth = 1; depth > 0 && skipBlank();) {
            const char c = text_[at_];
            step();
            if (c == '"' || c == '\'') skipText(c);
            if (c == '{' || c == '<' || c == '[') ++depth;
            if (c == '}' || c == '>' || c == ']') --depth;
        }
    }
    [[nodiscard]] std::size_t at() const { return at_; }
    /// Whether a brace follows, with a colon before it or none.
    bool opensBrace() {
        if (skipBlank() && text_[at_] == ':') step();
        return skipBlank() && text_[at_] == '{';
    }
    void step() {
        const char c = text_[at_++];
        if (c == '\n')
            ++line_, column_ = 0;
        else
            column_ += c == '\t' ? 8 - column_ % 8 : 1;
    }
    /// What stands in quotes here, with a colon before it or none; empty: nothing, or not all of it.
    std::string_view quoted() {
        if (skipBlank() && text_[at_] == ':') step();
        if (!skipBlank() || (text_[at_] != '"' && text_[at_] != '\'')) return {};
        const std::string_view rest = text_.substr(at_ + 1);
        const std::size_t end = rest.find(text_[at_]);
        return end == std::string_view::npos ? std::string_view() : rest.substr(0, end);
    }

private:
    static bool isWordCharacter(char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    }
    /// False: the text is over.
    bool skipBlank() {
        for (; at_ < text_.size(); step()) {
            if (text_[at_] == '#')
                while (at_ < text_.size() && text_[at_] != '\n') step();
            if (at_ == text_.size()) break;
            if (static_cast<unsigned char>(text_[at_]) > ' ') return true;
        }
        return false;
    }
    void skipText(char quote) {
        while (at_ < text_.size() && text_[at_] != '\n') {
            const char c = text_[at_];
            step();
            if (c == quote) return;
            if (c == '\\' && at_ < text_.size() && text_[at_] != '\n') step();
        }
    }
    SavedPart takeWord() {
        SavedPart part{.begin = at_, .end = at_, .line = line_};
        part.column = static_cast<int>(std::min(column_, kMostColumn));
        while (at_ < text_.size() && isWordCharacter(text_[at_])) step();
        part.end = at_;
        return part;
    }

    std::string_view text_;
    std::size_t at_ = 0;
    int line_ = 0;
    std::int64_t column_ = 0;  // tabs make it eight times the bytes of a line
    static constexpr std::int64_t kMostColumn = 1'000'000'000;
};

}  // namespace

Expected<std::optional<SavedPart>> findSavedPart(std::string_view text) {
    std::optional<SavedPart> found;
    TopScanner scanner(text);
    while (std::optional<SavedPart> word = scanner.word()) {
        if (text.substr(word->begin, word->end - word->begin) != textform::kSaved) continue;
        TopScanner inside = scanner;
        if (!inside.beginsNested()) continue;
        if (found)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}:{}: saved is there twice", word->line + 1, word->column + 1));
        (void)scanner.opensBrace();
        scanner.step();
        scanner.skipBraces();
        word->end = scanner.at();
        found = word;
    }
    return found;
}

std::string arraysNamedIn(std::string_view head) {
    TopScanner scanner(head);
    const auto reaches = [&](std::string_view wanted) {
        while (const std::optional<SavedPart> word = scanner.word())
            if (head.substr(word->begin, word->end - word->begin) == wanted) return true;
        return false;
    };
    for (const std::string_view around : {textform::kSaved, textform::kArrays}) {
        if (!reaches(around) || !scanner.opensBrace()) return {};
        scanner.step();
    }
    const std::string_view name = reaches(textform::kFile) ? scanner.quoted() : std::string_view();
    return isArraysName(name) ? std::string(name) : std::string();
}

}  // namespace tessera
