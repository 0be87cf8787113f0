/// Whether the films of a list have images of their own.
#pragma once

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Of Movies as the list leaves them behind, with ids in place of placeholders: no two write one Image. Costs a look at the scene's objects where a list says what
/// image a Movie writes, else a look-up per column.
[[nodiscard]] Sound checkMovies(const Aspect& scene, const ChangeList& list);

}  // namespace tessera
