/// Whether images that a list touches have the bytes that their size needs.
#pragma once

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Of images as the list leaves them behind, with ids in place of placeholders (checkImage says what is not sound).
/// Fields that say how a surface takes an image are not looked at. Costs a look-up per entry of those that are.
[[nodiscard]] Sound checkImages(const Aspect& scene, const ChangeList& list);

}  // namespace tessera
