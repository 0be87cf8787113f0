/// What is left of a motion where it may not go on against what it has met.
#pragma once

#include <span>

#include "common/math/Types.h"

namespace tessera {

/// The part of `wanted` that goes into none of the surfaces whose ways out (of unit length) are given: itself, along
/// one of them, along the crease of two, or nothing. Nearest to `wanted` of all such; of two equally near the one along
/// the first.
[[nodiscard]] Vec3d tangent(const Vec3d& wanted, std::span<const Vec3d> waysOut);

}  // namespace tessera
