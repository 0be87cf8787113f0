/// Trackers, heads and wands of proto/wall.proto. Inside of the codec only.
#pragma once

#include <optional>

#include "common/wall/Wall.h"

namespace tessera {

namespace proto {
class Wall;
}

void putTracking(const Wall& wall, proto::Wall& message);
/// The fault is one that a Wall could not say any more: a tracker without a protocol. The rest is findTrackingFault's.
[[nodiscard]] std::optional<WallFault> readTracking(const proto::Wall& message, Wall& wall);

}  // namespace tessera
