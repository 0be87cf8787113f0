/// What a verb answers: the same for people and for programs.
#pragma once

#include <nlohmann/json.hpp>

#include <functional>
#include <string>

#include "common/json/ChangeJson.h"
#include "common/scene/Aspect.h"

namespace tessera {

struct Answer {
    std::string text;  ///< lines, each ended
    nlohmann::ordered_json json;
    std::string warning;  ///< for stderr; empty: none
};

/// Takes lines at once that are not to wait for the end of the verb.
using Print = std::function<void(const std::string&)>;

[[nodiscard]] nlohmann::ordered_json jsonOf(const Vec3d& v);
/// As people read it: of many digits six count. JSON has them all.
[[nodiscard]] std::string readable(double number);
/// Zero where a component is nothing beside the largest.
[[nodiscard]] Vec3d withoutNoise(const Vec3d& v);
/// "(1, 2.5, -3)"
[[nodiscard]] std::string textOf(const Vec3d& v);
/// "#17"
[[nodiscard]] std::string numberOf(ObjectId id);
/// As a terminal may have it: of control characters only ends of lines and tabs are left, others become '?'. What turns
/// the direction of text is written as JSON has it, `\u202e`. Names and texts are strangers'.
[[nodiscard]] std::string withoutControls(std::string text);
/// On one line. Names come from files: what is no UTF-8 in them must not stop the answer.
[[nodiscard]] std::string jsonLine(const nlohmann::ordered_json& json);

}  // namespace tessera
