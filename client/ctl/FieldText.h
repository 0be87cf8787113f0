/// Field values as people write and read them, by the field table.
#pragma once

#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// A field of a node or of its core: which object, which entry of the table.
struct FieldPlace {
    ObjectId object;
    const TypeInfo* type = nullptr;
    const FieldInfo* field = nullptr;
};

/// The node's own fields come first. kNotFound names the fields there are.
[[nodiscard]] Expected<FieldPlace> findFieldOf(const Aspect& aspect, ObjectId node, const std::string& name);

/// Numbers, one text, a node's path, "#id" or "none"; as many as the field is wide. kUsage says what it wants.
[[nodiscard]] Expected<FieldValue> parseValue(const Aspect& aspect, const FieldInfo& field,
                                              const std::vector<std::string>& words);

/// The same; numbers that stand for something may be words (FieldWords.h). kUsage names the words there are.
[[nodiscard]] Expected<FieldValue> parseValue(const Aspect& aspect, const FieldPlace& place,
                                              const std::vector<std::string>& words);

/// For people: "1 2 3", "#17", a text as it is, "4800 bytes".
[[nodiscard]] std::string textOf(const FieldValue& value);

}  // namespace tessera
