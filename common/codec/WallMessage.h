/// The message of proto/wall.proto as a Wall. Inside of the codec only.
#pragma once

#include "common/base/Error.h"
#include "common/codec/OutputMessage.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Checked; a fault says which part of the message is meant. `files`: see `outputOf`.
[[nodiscard]] tl::expected<Wall, WallFault> wallOf(const proto::Wall& message, const WallFiles& files = nullptr);
[[nodiscard]] proto::Wall messageOf(const Wall& wall);

}  // namespace tessera
