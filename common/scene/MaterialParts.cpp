#include "common/scene/MaterialParts.h"

#include <fmt/format.h>

namespace tessera {

Expected<void> checkLayers(const Material& material) {
    if (material.layers.size() <= Material::kMostLayers) return {};
    return fail(ErrorCode::kRefused, fmt::format("{} texture layers; a material has at most {}", material.layers.size(),
                                                 Material::kMostLayers));
}

}  // namespace tessera
