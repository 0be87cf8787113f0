/// Whether the films of a list have images of their own.
#pragma once

#include <set>

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Of Movies as the list leaves them behind, with ids in place of placeholders: no two write one Image. Costs a look at
/// `movies`, all that the scene has, where a list says what image one writes, else a look-up per column.
[[nodiscard]] Sound checkMovies(const Aspect& scene, const ChangeList& list, const std::set<ObjectId>& movies);

}  // namespace tessera
