/// What no format for other programs has of our materials.
#pragma once

#include <cstdint>
#include <span>

#include "common/cores/Material.h"
#include "common/export/ExportNotes.h"

namespace tessera {

/// Notes fills, layers, passes, programs and coarser materials, and Phong's highlights, which become roughness.
void noteLostLooks(const Material& material, ExportNotes& notes, ObjectId node);

/// Of formats whose vertices have no opacity: notes those that are not opaque, four bytes each.
void noteLostOpacities(std::span<const std::uint8_t> colors, ExportNotes& notes, ObjectId node);

/// The roughness whose highlight is about as wide as Blinn's with this exponent (Walter et al. 2007, "Microfacet Models
/// for Refraction through Rough Surfaces": exponent = 2 / alpha² - 2, alpha = roughness²).
[[nodiscard]] float roughnessOfShininess(float shininess);

}  // namespace tessera
