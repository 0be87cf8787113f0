/// Whether materials stay within what hosts draw.
#pragma once

#include "common/change/ChangeList.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Of what the list says of materials: so many passes, layers and uniforms at most, and no material among its own
/// passes. A list that says other nonsense is the scene's to refuse. Whether a program is any good is no question for a
/// commit: see server/programs.
[[nodiscard]] Sound checkMaterials(const ChangeList& list);

}  // namespace tessera
