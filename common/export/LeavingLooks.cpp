#include "common/export/LeavingLooks.h"

#include <algorithm>
#include <cmath>

namespace tessera {

void noteLostLooks(const Material& material, ExportNotes& notes, ObjectId node) {
    if (material.shading == Material::kPhong) notes.add("Phong's highlights are written as roughness", node);
    if (material.fill != Material::kFilled) notes.add("edges and corners of materials are written as surfaces", node);
    if (!material.layers.empty()) notes.add("layers of images are left out", node);
    if (!material.passes.empty()) notes.add("further passes of materials are left out", node);
    if (material.program) notes.add("programs of materials are left out", node);
    if (material.coarser) notes.add("coarser materials for far away are left out", node);
}

void noteLostOpacities(std::span<const std::uint8_t> colors, ExportNotes& notes, ObjectId node) {
    for (std::size_t i = 3; i < colors.size(); i += 4)
        if (colors[i] != 255) return notes.add("opacities of vertices are left out", node);
}

float roughnessOfShininess(float shininess) {
    return std::pow(2.0f / (std::max(shininess, 0.0f) + 2.0f), 0.25f);
}

}  // namespace tessera
