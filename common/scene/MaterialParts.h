/// What a Material may name.
#pragma once

#include "common/base/Error.h"
#include "common/cores/Material.h"

namespace tessera {

/// Says what is wrong with a material's texture layers by themselves: more than kMostLayers. Others are no error: a
/// layer without an image is nothing, and so is one whose source says no place in an image of that shape (texture
/// coordinates of a cube), which hosts count as an image that is missing.
[[nodiscard]] Expected<void> checkLayers(const Material& material);

}  // namespace tessera
