/// One value of a JSON file with its place in it. What is wrong is told to a WallReading, with that place.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/json/Json.h"
#include "server/tools/walls/WallReading.h"

namespace tessera {

/// Valid as long as the value and the reading are. One that is missing, or null, can be asked like any other.
class JsonNode {
public:
    JsonNode(const Json* json, std::string place, WallReading& reading)
        : json_(json), place_(std::move(place)), reading_(&reading) {}

    [[nodiscard]] bool there() const;
    [[nodiscard]] const std::string& place() const { return place_; }
    void refuse(std::string_view what) const { reading_->refuse(place_, what); }

    /// A member; of what is no object, none.
    [[nodiscard]] JsonNode operator[](std::string_view key) const;
    /// Of an array. Missing: none; anything else is refused.
    [[nodiscard]] std::vector<JsonNode> elements() const;
    /// Of an object. Missing: none; anything else is refused.
    [[nodiscard]] std::vector<std::pair<std::string, JsonNode>> members() const;

    /// Without `otherwise` a missing one is refused.
    [[nodiscard]] double number(double least, double most, std::optional<double> otherwise = {}) const;
    [[nodiscard]] std::string text(std::optional<std::string> otherwise = {}) const;
    [[nodiscard]] bool flag(bool otherwise) const;

private:
    const Json* json_;
    std::string place_;
    WallReading* reading_;
};

}  // namespace tessera
