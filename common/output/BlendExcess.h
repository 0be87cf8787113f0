/// Blend pictures that let through more than one projector's light.
#pragma once

#include <optional>

#include "common/base/Error.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Looks at the screens whose outputs have blend pictures: at each pixel of the screen the shares of light of its tiles
/// add up to at most 1.02 (a mean of two 8-bit pictures' rounding, with room). Of outputs with a warp, or of another
/// size than their tiles, the means over squares of 16 pixels are looked at, up to 1.05. Also pictures that cannot be
/// read. The first finding, with the tile, the place and the sum.
[[nodiscard]] std::optional<OutputFault> findBlendExcess(const Wall& wall);

}  // namespace tessera
