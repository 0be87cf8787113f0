/// Words for numbers that stand for something: "slide" for an Interest's response 2. As scene files have them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/FieldTable.h"

namespace tessera {

/// Of a whole-number field of a type; nothing where it has no such word.
[[nodiscard]] std::optional<std::int64_t> numberOfWord(ObjectType type, FieldId field, std::string_view word);
/// All that the field has, in the order of their numbers; empty for most fields.
[[nodiscard]] std::vector<std::string_view> wordsOf(ObjectType type, FieldId field);

/// "points,normals,faces", any of them, or "none": the bits of Interest::show. Nothing where a word is none of these.
[[nodiscard]] std::optional<std::int64_t> showBits(std::string_view words);
[[nodiscard]] std::string showWords(std::int64_t bits);

}  // namespace tessera
