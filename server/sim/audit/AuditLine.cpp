#include "server/sim/audit/AuditLine.h"

#include <fmt/chrono.h>

#include <nlohmann/json.hpp>
#include <string_view>

#include "common/base/Controls.h"

namespace tessera {
namespace {

/// JSON lets most of them stand as they are, which only its texts may have.
std::string withNumbersForControls(std::string_view json) {
    std::string text;
    while (!json.empty()) {
        const std::string_view character = json.substr(0, utf8CharacterLength(json));
        const char32_t number = numberOfCharacter(character);
        if (isControl(number))
            text += fmt::format("\\u{:04x}", static_cast<unsigned>(number));
        else
            text += character;
        json.remove_prefix(character.size());
    }
    return text;
}

}  // namespace

std::string toJson(const AuditLine& line) {
    const auto at = std::chrono::floor<std::chrono::milliseconds>(line.at);
    const auto seconds = std::chrono::floor<std::chrono::seconds>(at);
    nlohmann::ordered_json json;
    json["at"] = fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", seconds, (at - seconds).count());
    json["who"] = line.who.name;
    json["by"] = nameOf(line.who.by);
    json["role"] = nameOf(line.who.role);
    json["program"] = line.program;
    json["from"] = line.from;
    json["did"] = line.did;
    if (!line.objects.empty()) json["objects"] = line.objects;
    if (line.changes != 0) json["changes"] = line.changes;
    if (line.times != 1) json["times"] = line.times;
    if (!line.refused.empty()) json["refused"] = line.refused;
    return withNumbersForControls(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace tessera
