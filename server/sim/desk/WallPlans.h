/// Where a wall's screens and tiles are, as those are told who show it elsewhere.
#pragma once

#include "common/request/ViewRequests.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Tiles in the order in which hosts and tiles are written; positions in the wall's frame, metres. `view`: where the
/// wall stands and where heads are now; null: nobody knows, and heads are where the wall's file has them.
[[nodiscard]] answer::WallPlan planOf(const Wall& wall, const View* view);

}  // namespace tessera
