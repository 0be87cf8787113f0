/// Whether cores make sense by themselves: arrays that fit together, ranges that ascend, layers that hosts can draw.
#pragma once

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Of what the list leaves behind, with ids in place of placeholders: present values where it says nothing of them. The
/// first core that makes no sense, by its type and number. A list that says other nonsense is the scene's to refuse.
/// `scene`: before the list; what it holds has passed this. Costs a look at the cores whose arrays the list names, of
/// edits of ranges at what they hold.
[[nodiscard]] Expected<void> checkCores(const Aspect& scene, const ChangeList& list);

}  // namespace tessera
