/// Where a reader of USD's text is, and the small things that stand there.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/Error.h"
#include "server/import/reader/usd/UsdValue.h"

namespace tessera {

/// All functions return false once something is wrong; `error` says what was first, and where. Blanks, line breaks and
/// comments before what is asked for are skipped.
class UsdTextCursor {
public:
    explicit UsdTextCursor(std::string_view text) : text_(text) {}

    /// The next character that counts; 0 at the end.
    [[nodiscard]] char next();
    [[nodiscard]] bool accept(char c);
    bool expect(char c, std::string_view where);
    /// Directly behind what was read last.
    [[nodiscard]] bool acceptHere(char c);
    /// Takes the word if it stands here whole.
    [[nodiscard]] bool acceptWord(std::string_view word);
    /// A name of letters, digits, `_` and `:`; false without an error: there is none.
    [[nodiscard]] bool identifier(std::string_view& name);
    /// In any of the four quotes.
    bool string(std::string& out);
    /// @in/such.signs@.
    bool asset(std::string& out);
    /// <in/such>.
    bool path(std::string& out);
    bool number(double& out);
    /// What stands in brackets of any kind, and they.
    bool skipBrackets();

    /// Of a type that is known.
    bool value(const UsdType& type, const std::string& typeName, UsdValue& out);
    /// Of a type that is to be guessed.
    bool anyValue(UsdValue& out, int depth = 0);
    bool dictionary(UsdValue& out, int depth = 0);

    /// Remembers what is wrong here; false.
    bool fault(std::string message, ErrorCode code = ErrorCode::kBadInput);
    /// Of the place where it is, from 1.
    [[nodiscard]] std::size_t line() const;
    [[nodiscard]] bool failed() const { return error_.has_value(); }
    [[nodiscard]] tl::unexpected<Error> error() const { return tl::unexpected<Error>(*error_); }

private:
    void skipBlank();
    template <typename Number>
    bool numbers(const UsdType& type, const std::string& typeName, UsdValue& out);
    template <typename Number>
    bool element(std::vector<Number>& out, int depth);
    bool word(std::string& out);
    bool words(UsdValue& out);

    std::string_view text_;
    std::size_t at_ = 0;
    std::optional<Error> error_;
};

}  // namespace tessera
