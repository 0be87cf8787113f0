#include "common/scene/ColumnShapes.h"

#include <fmt/core.h>

namespace tessera {

Expected<const FieldEntry*> fieldOfColumn(const FieldColumn& column) {
    const TypeInfo* type = findType(column.type);
    if (!type) return fail(ErrorCode::kBadInput, fmt::format("set: object type {} is unknown", column.type.value));
    const FieldEntry* field = findField(*type, column.field);
    if (!field)
        return fail(ErrorCode::kBadInput, fmt::format("set: {} has no field {}", type->name, column.field.value));
    if (column.kind() != field->kind || column.width != field->width)
        return fail(ErrorCode::kBadInput,
                    fmt::format("set {}.{}: it holds {} {}, not {} {}", type->name, field->name, field->width,
                                nameOf(field->kind), column.width, nameOf(column.kind())));
    if (column.scalarCount() != column.ids.size() * column.width)
        return fail(ErrorCode::kBadInput, fmt::format("set {}.{}: {} objects, but {} scalars", type->name, field->name,
                                                      column.ids.size(), column.scalarCount()));
    return field;
}

Expected<void> checkColumnShapes(const ChangeList& list) {
    for (const FieldColumn& column : list.columns)
        if (const Expected<const FieldEntry*> field = fieldOfColumn(column); !field)
            return tl::unexpected(field.error());
    return {};
}

}  // namespace tessera
