/// What a surface looks like.
#pragma once

#include "common/field/Field.h"
#include "common/cores/Image.h"

namespace tessera {

/// Metal-roughness shading as glTF 2.0 defines it. Colours are linear RGB.
struct Material {
    static constexpr ObjectType kType{5};
    Vec4f baseColor{0.8f, 0.8f, 0.8f, 1.0f};  ///< alpha below 1: drawn as transparent
    float metallic = 0.0f;
    float roughness = 0.6f;
    Vec3f emissive = Vec3f::Zero();
    ObjectId baseColorImage;  ///< an Image (sRGB); none: white
    bool doubleSided = false;
};
template <>
inline constexpr auto kDescription<Material> =
    describe("Material",
             field<&Material::baseColor>(1, "baseColor").affects(Effect::kLook),
             field<&Material::metallic>(2, "metallic").affects(Effect::kLook),
             field<&Material::roughness>(3, "roughness").affects(Effect::kLook),
             field<&Material::emissive>(4, "emissive").affects(Effect::kLook),
             field<&Material::baseColorImage>(5, "baseColorImage").to<Image>().affects(Effect::kLook),
             field<&Material::doubleSided>(6, "doubleSided").affects(Effect::kLook))
        .notACore();

}  // namespace tessera
