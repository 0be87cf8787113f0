/// The message of proto/wall.proto as a Wall. Inside of the codec only.
#pragma once

#include "common/base/Error.h"
#include "common/wall/Wall.h"

namespace tessera {

namespace proto {
class Wall;
}

/// Checked; a fault says which part of the message is meant.
[[nodiscard]] tl::expected<Wall, WallFault> wallOf(const proto::Wall& message);

}  // namespace tessera
