#include "server/sim/audit/AuditLine.h"

#include <fmt/chrono.h>

#include <nlohmann/json.hpp>

namespace tessera {

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
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace tessera
