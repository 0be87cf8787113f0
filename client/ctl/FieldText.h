/// Field values as people write and read them, by the field table.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/application/SceneExcerpt.h"
#include "common/base/Error.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// A field of a node or of its core: which object, which entry of the table.
struct FieldPlace {
    ObjectId object;
    const TypeInfo* type = nullptr;
    const FieldEntry* field = nullptr;
};

/// A node's own fields come first, then its core's; of any other object its own. kNotFound names the fields there are.
[[nodiscard]] Expected<FieldPlace> findFieldOf(const ObjectInfo& object, const std::string& name);

/// The object at a node's path or "#id".
using FindObject = std::function<Expected<ObjectId>(const std::string& name)>;

/// Numbers, one text, true or false, a node's path, "#id" or "none"; as many as the field is wide. Of references as
/// many as are wanted, and of arrays of numbers all numbers of as many elements, or "none". Numbers that have words may
/// be said by them. kUsage says what it wants.
[[nodiscard]] Expected<FieldValue> parseValue(const FindObject& find, const FieldInfo& field,
                                              const std::vector<std::string>& words);

/// "points@17": a part of an array of floats, from an element on. Only where the field is one.
struct ArrayPart {
    std::string field;
    std::uint64_t first = 0;
};
/// Nothing where no part is meant. kUsage where what follows the @ is no number.
[[nodiscard]] Expected<std::optional<ArrayPart>> parseArrayPart(const std::string& field);
/// The floats of some elements, as they lie in the array. kUsage says what it wants.
[[nodiscard]] Expected<Blob> parseElements(const FieldInfo& field, const std::vector<std::string>& words);

/// For people: "1 2 3", "#17", a text as it is, "4800 bytes".
[[nodiscard]] std::string textOf(const FieldValue& value);

/// The same by its word, where its number has one: "loop"; of an array of numbers "3 elements", or "none".
[[nodiscard]] std::string wordOf(const FieldInfo& field, const FieldValue& value);

/// The same with numbers as people read them.
[[nodiscard]] std::string readableWordOf(const FieldInfo& field, const FieldValue& value);

/// Which of an interest's contacts are drawn: the field whose words `contacts --show` takes.
[[nodiscard]] const FieldInfo& showField();

}  // namespace tessera
