#include "server/tools/walls/JsonNode.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace tessera {

bool JsonNode::there() const {
    return json_ != nullptr && !json_->is_null();
}

JsonNode JsonNode::operator[](std::string_view key) const {
    const std::string place = place_.empty() ? std::string(key) : fmt::format("{}.{}", place_, key);
    if (!there()) return {nullptr, place, *reading_};
    if (!json_->is_object()) {
        refuse("an object is needed, { … }");
        return {nullptr, place, *reading_};
    }
    const auto at = json_->find(key);
    return {at == json_->end() ? nullptr : &*at, place, *reading_};
}

std::vector<JsonNode> JsonNode::elements() const {
    std::vector<JsonNode> all;
    if (!there()) return all;
    if (!json_->is_array()) {
        refuse("an array is needed, [ … ]");
        return all;
    }
    for (const Json& one : *json_) all.emplace_back(&one, fmt::format("{}[{}]", place_, all.size()), *reading_);
    return all;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::members() const {
    std::vector<std::pair<std::string, JsonNode>> all;
    if (!there()) return all;
    if (!json_->is_object()) {
        refuse("an object is needed, { … }");
        return all;
    }
    for (const auto& [key, value] : json_->items())
        all.emplace_back(key, JsonNode(&value, fmt::format("{}.{}", place_, key.substr(0, 60)), *reading_));
    return all;
}

double JsonNode::number(double least, double most, std::optional<double> otherwise) const {
    if (!there() && otherwise) return *otherwise;
    const double value = there() && json_->is_number() ? json_->get<double>() : 0;
    if (there() && json_->is_number() && value >= least && value <= most) return value;
    refuse(fmt::format("a number from {:g} to {:g} is needed{}", least, most,
                       there() ? fmt::format(", not {}", jsonText(*json_).substr(0, 40)) : ", and nothing is there"));
    return 0;
}

std::string JsonNode::text(std::optional<std::string> otherwise) const {
    if (!there() && otherwise) return *otherwise;
    if (there() && json_->is_string()) return json_->get<std::string>();
    refuse(there() ? "a text is needed" : "a text is needed, and nothing is there");
    return {};
}

bool JsonNode::flag(bool otherwise) const {
    if (!there()) return otherwise;
    if (json_->is_boolean()) return json_->get<bool>();
    refuse("true or false is needed");
    return otherwise;
}

}  // namespace tessera
