/// From linear light to the bytes of a picture, as the shaders do it.
#pragma once

#include "common/math/Types.h"

namespace tessera {

/// Tone mapping, then sRGB encoding: what an opaque pixel of this linear colour becomes, 0 to 1. Khronos PBR Neutral (2024)
/// without its toe: the identity up to 0.8.
[[nodiscard]] Vec3f encodedColor(const Vec3f& linear);

}  // namespace tessera
