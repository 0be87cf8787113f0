/// Content of a scene file that follows from the table of types: a message is called like its type, its fields like the type's
/// in snake_case.
#pragma once

#include <utility>
#include <vector>

#include "common/scene/FieldTable.h"
#include "server/import/LoadedFile.h"

namespace tessera {

/// A core as a file says it: only the fields that are there.
struct TableCore {
    const TypeInfo* type = nullptr;
    std::vector<std::pair<FieldId, FieldValue>> fields;
};

/// The type that a node's content is called like, or null.
[[nodiscard]] const TypeInfo* tableTypeOf(const proto::scene::Node& node);

/// Reads a content whose type is in the table. Numbers are bounded by their fields' bounds; a colour, a vector, factors and a
/// rotation have their usual messages; angles stand in degrees as `…_deg`. References are left out: names are resolved later.
[[nodiscard]] Expected<TableCore> readTableCore(const proto::scene::Node& node, const TypeInfo& type);

}  // namespace tessera
