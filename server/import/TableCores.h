/// What of a scene file follows from the table of types: a message is called like its type, its fields like the type's
/// in snake_case.
#pragma once

#include <google/protobuf/message.h>

#include <string>
#include <utility>
#include <vector>

#include "common/scene/FieldTable.h"
#include "server/import/LoadedFile.h"

namespace tessera {

/// An object as a file says it: only the fields that are there.
using TableFields = std::vector<std::pair<FieldId, FieldValue>>;

/// The type that a node's content is called like, or null.
[[nodiscard]] const TypeInfo* tableTypeOf(const proto::scene::Node& node);

/// The content of a node whose type is in the table.
[[nodiscard]] const google::protobuf::Message& contentOf(const proto::scene::Node& node);

/// A number that became the nearest good one (`takeNearest`).
struct Mended {
    int field = 0;  ///< its number in the message
    std::string what;
};

/// "line:column: " of a material's field; empty where the file is no text.
[[nodiscard]] std::string placeIn(const proto::scene::Material& material, int field);

/// Numbers are bounded by their fields' bounds, those of `mended` where it is told of them; a colour, a vector, factors
/// and a rotation have their usual messages; angles stand in degrees as `…_deg`. References and arrays are left out:
/// who knows the message reads them.
[[nodiscard]] Expected<TableFields> readTableFields(const google::protobuf::Message& message, const TypeInfo& type,
                                                    std::vector<Mended>* mended = nullptr);

/// The same as a struct; what the message does not say is as in a fresh one.
template <typename T>
[[nodiscard]] Expected<T> readTableObject(const google::protobuf::Message& message,
                                          std::vector<Mended>* mended = nullptr) {
    const TypeInfo& type = *findType(T::kType);
    const Expected<TableFields> fields = readTableFields(message, type, mended);
    if (!fields) return tl::unexpected(fields.error());
    T object;
    for (const auto& [field, value] : *fields) findField(type, field)->store(&object, value);
    return object;
}

}  // namespace tessera
