#include "common/json/Json.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace tessera {
namespace {

/// Of what is open at once, outside of texts. The parser itself would take any depth, and whoever walks the value would
/// not.
bool isTooDeep(std::string_view text) {
    std::size_t depth = 0;
    bool inText = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (inText) {
            if (c == '\\') ++i;
            if (c == '"') inText = false;
        } else if (c == '"') {
            inText = true;
        } else if (c == '[' || c == '{') {
            if (++depth > kMaxJsonDepth) return true;
        } else if ((c == ']' || c == '}') && depth > 0) {
            --depth;
        }
    }
    return false;
}

}  // namespace

std::string_view wordOf(ErrorCode code) {
    static constexpr std::array<std::string_view, 8> kWords{"usage", "bad_input", "not_found",   "refused",
                                                            "limit", "network",   "unsupported", "failed"};
    return kWords[static_cast<std::size_t>(code)];
}

Json errorJson(const ApiError& error) {
    Json json{{"code", wordOf(error.code)}, {"message", error.message}};
    if (!error.field.empty()) json["field"] = error.field;
    return json;
}

ApiExpected<Json> parseJson(std::string_view text) {
    if (isTooDeep(text))
        return tl::unexpected(
            ApiError{ErrorCode::kLimit, fmt::format("JSON that is nested deeper than {} levels", kMaxJsonDepth)});
    // Readers differ in which of two counts: what a gate has seen would not be what is done.
    std::vector<std::set<std::string>> named;
    std::string twice;
    const auto look = [&](int, Json::parse_event_t event, Json& value) {
        if (event == Json::parse_event_t::object_start) named.emplace_back();
        if (event == Json::parse_event_t::object_end) named.pop_back();
        if (event == Json::parse_event_t::key && !named.back().insert(value.get<std::string>()).second && twice.empty())
            twice = value.get<std::string>();
        return true;
    };
    try {
        Json json = Json::parse(text, look);
        if (twice.empty()) return json;
        return tl::unexpected(
            ApiError{ErrorCode::kBadInput, fmt::format("no JSON: \"{}\" is said twice", twice), twice});
    } catch (const Json::exception& wrong) {
        // "[json.exception.parse_error.101] parse error at line 1, column 2: …": from the place on it is for people.
        std::string_view why = wrong.what();
        if (const std::size_t place = why.find("] "); place != std::string_view::npos) why.remove_prefix(place + 2);
        if (const std::size_t read = why.find("; last read"); read != std::string_view::npos) why = why.substr(0, read);
        return tl::unexpected(ApiError{ErrorCode::kBadInput, fmt::format("no JSON: {}", why)});
    }
}

std::string jsonText(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace tessera
