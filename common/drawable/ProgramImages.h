/// Which images a person's program can read.
#pragma once

#include <optional>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Programs declare samplers of flat images alone (sampler2D). The first of the material's uniforms whose image is a cube or a solid: with one the
/// material is drawn without its program, on every host.
[[nodiscard]] inline std::optional<ObjectId> uniformOfAnotherShape(const Aspect& scene, const Material& material) {
    for (const ObjectId id : material.uniforms) {
        const auto* uniform = scene.get<Uniform>(id);
        const auto* image = uniform && uniform->image ? scene.get<Image>(uniform->image) : nullptr;
        if (image && (image->shape == Image::kCube || image->shape == Image::kSolid)) return id;
    }
    return std::nullopt;
}

}  // namespace tessera
