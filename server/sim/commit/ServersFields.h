/// Fields that the server alone says: what it found out of an object.
#pragma once

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Of an edit of a person or an application: of what is there it says no other verdict or problem of a SurfaceProgram,
/// no other problem of a Movie, and does not say which handle of a Manipulator is held, nor how large users see it, nor
/// whether an Inline is there (common/scene/WrittenByServer.h). What is new may come with anything; whoever finds out
/// says it anew. Costs a look-up per column.
[[nodiscard]] Expected<void> checkServersFields(const Aspect& scene, const ChangeList& list);

}  // namespace tessera
