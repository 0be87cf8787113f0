#include "common/json/Json.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/json/JsonValues.h"

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

/// What the parser takes, and readers differ in, or it takes too long for. Names of members are looked through one by
/// one.
class Looker : public nlohmann::json_sax<Json> {
public:
    [[nodiscard]] const std::optional<ApiError>& found() const { return found_; }

    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool string(string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_array(std::size_t) override { return true; }
    bool end_array() override { return true; }
    bool start_object(std::size_t) override {
        if (depth_ == named_.size()) named_.emplace_back();
        named_[depth_++].clear();
        return true;
    }
    bool end_object() override {
        --depth_;
        return true;
    }
    bool key(string_t& name) override {
        // Which of two counts, readers say differently: what a gate has seen would not be what is done.
        std::set<std::string>& names = named_[depth_ - 1];
        if (!names.insert(name).second)
            found_ = {ErrorCode::kBadInput, fmt::format("no JSON: \"{}\" is said twice", shortened(name)),
                      shortened(name)};
        else if (names.size() > kMaxJsonMembers)
            found_ = {ErrorCode::kLimit, fmt::format("an object with more than {} members", kMaxJsonMembers)};
        return !found_;
    }
    bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

private:
    std::vector<std::set<std::string>> named_;  ///< of the objects that are open, and room
    std::size_t depth_ = 0;
    std::optional<ApiError> found_;
};

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
    // Twice, and not with the parser's callback: with that, an array of objects takes the square of their number.
    Looker looker;
    (void)Json::sax_parse(text, &looker);
    if (looker.found()) return tl::unexpected(*looker.found());
    try {
        return Json::parse(text);
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
