/// Which images a person's program can read.
#pragma once

#include <optional>
#include <string_view>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Whether a text declares `uniform sampler2D NAME;`, remarks left away.
[[nodiscard]] bool declaresSampler(std::string_view text, std::string_view name);

/// Programs declare samplers of flat images alone (sampler2D). The first of the material's uniforms that its program
/// declares so, and whose image is a cube or a solid: with one the material is drawn without its program, on every
/// host. An image that no sampler is called after is not looked at.
[[nodiscard]] std::optional<ObjectId> uniformOfAnotherShape(const Aspect& scene, const Material& material);

}  // namespace tessera
