/// The light of scenes that bring none.
#pragma once

#include <vector>

#include "client/render/DrawList.h"

namespace tessera {

/// Three directional lights that are fixed in the world, without shadows.
[[nodiscard]] std::vector<LightItem> defaultLights();

/// Of a studio: the same from stronger contrasts; the first one has shadows.
[[nodiscard]] std::vector<LightItem> studioLights();
[[nodiscard]] Environment studioEnvironment();
/// What stands around a model of which shadows fall on the ground.
[[nodiscard]] Box studioFloor(const Studio& studio);

}  // namespace tessera
