/// What each type of object and each of its fields is for, in a sentence for people.
#pragma once

#include <string_view>

namespace tessera {

/// Of a type; empty where there is none of that name.
[[nodiscard]] std::string_view helpOfType(std::string_view type);
/// Of one of its fields.
[[nodiscard]] std::string_view helpOfField(std::string_view type, std::string_view field);

}  // namespace tessera
