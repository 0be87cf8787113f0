/// Whether the columns of a list are of the fields that they name.
#pragma once

#include "common/change/ChangeList.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// Returns the field of a column. kBadInput: there is no such field, or the column has values of another kind, width or
/// number.
[[nodiscard]] Expected<const FieldEntry*> fieldOfColumn(const FieldColumn& column);

/// Checks all columns of a list so. Whoever reads or adds to values of a list from outside calls this first. What else
/// may be wrong with the list, the scene says when it is applied.
[[nodiscard]] Expected<void> checkColumnShapes(const ChangeList& list);

}  // namespace tessera
