/// What a screen shows of a colour that no shader computes.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/math/Types.h"

namespace tessera {

/// The function of glsl/ToneCurves.glsl for a value of Environment::toneMap.
[[nodiscard]] std::string_view toneCurveOf(std::int64_t toneMap);

/// The same curve of exposed radiance, in double precision: linear colours, from 0 to 1 where that is.
[[nodiscard]] Vec3d toneMapped(std::int64_t toneMap, const Vec3d& radiance);

}  // namespace tessera
