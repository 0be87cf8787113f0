/// JSON as doors speak it: for who sends text to programs of other languages.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"

namespace tessera {

/// Members stay in the order in which they were written.
using Json = nlohmann::ordered_json;

/// What was wrong, for programs and for people: `{"error":{"code","message","field"}}`.
struct ApiError {
    ErrorCode code = ErrorCode::kFailed;
    std::string message;
    std::string field = {};  ///< "input.held", "list.set[2].values[0]"; empty: no field was wrong
};
template <typename T>
using ApiExpected = tl::expected<T, ApiError>;

/// "bad_input", "not_found", …: the word for programs.
[[nodiscard]] std::string_view wordOf(ErrorCode code);
/// `{"code":…,"message":…}`, with the field where there is one.
[[nodiscard]] Json errorJson(const ApiError& error);

inline constexpr std::size_t kMaxJsonDepth = 64, kMaxJsonMembers = 256;
/// Any bytes, in time linear in their number. kBadInput: no JSON, no UTF-8, two values, a number beyond a double, a
/// member said twice; kLimit: nested deeper than kMaxJsonDepth, an object with more than kMaxJsonMembers.
[[nodiscard]] ApiExpected<Json> parseJson(std::string_view text);
/// On one line. What is no UTF-8 in strangers' names becomes U+FFFD.
[[nodiscard]] std::string jsonText(const Json& json);

/// Binary frames that travel beside a text: `{"binary":0}` in it means the first of them.
using Binaries = std::vector<ByteSlice>;

}  // namespace tessera
