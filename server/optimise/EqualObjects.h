/// Objects that are equal become one.
#pragma once

#include <cstddef>

#include "common/base/Error.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Of images, layers of images, programs, materials, meshes and surfaces those that are equal field by field become the
/// one with the lowest id, and who named them names that one; references inside count as equal where they lead to equal
/// objects. What an animation, a movie or another object that is no drawable names stays by itself. How many are gone.
[[nodiscard]] Expected<std::size_t> shareEqualObjects(Aspect& scene);

}  // namespace tessera
