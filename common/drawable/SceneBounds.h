/// How large a scene is.
#pragma once

#include "common/math/Box.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// World bounds of all that is drawn at and below a node and that switches show; of what a server shows there
/// (ServerNodes.h) only where there is nothing else. Arrays must be resident; absent ones count as nothing. Cost:
/// proportional to the nodes, and to each mesh once.
[[nodiscard]] Box sceneBounds(const Aspect& scene, ObjectId from = kRootNode);

}  // namespace tessera
