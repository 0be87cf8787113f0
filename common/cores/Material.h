/// What a surface looks like.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Metal-roughness shading as glTF 2.0 defines it. Colours are linear RGB. What an image holds multiplies the number
/// beside it; an image that is missing is white.
struct Material {
    static constexpr ObjectType kType{5};
    static constexpr std::int64_t kAutoAlpha = 0, kOpaque = 1, kMask = 2, kBlend = 3;
    Vec4f baseColor{0.8f, 0.8f, 0.8f, 1.0f};
    float metallic = 0.0f;
    float roughness = 0.6f;
    Vec3f emissive = Vec3f::Zero();  ///< of any strength (KHR_materials_emissive_strength)
    ObjectId baseColorImage;         ///< an Image (sRGB, alpha)
    bool doubleSided = false;
    /// What alpha means. Auto: blended where baseColor's own is below 1, else ignored. Mask: what is below
    /// `alphaCutoff` is not there.
    std::int64_t alphaMode = kAutoAlpha;
    float alphaCutoff = 0.5f;
    ObjectId metallicRoughnessImage;  ///< green: roughness, blue: metallic; linear
    ObjectId normalImage;      ///< normals along the texture coordinates (red: u, green: against v), from -1 to 1
    float normalScale = 1.0f;  ///< of their red and green
    ObjectId occlusionImage;   ///< red: how much of the surroundings' light arrives; linear
    float occlusionStrength = 1.0f;
    ObjectId emissiveImage;  ///< sRGB
    bool unlit = false;      ///< the base colour as it is (KHR_materials_unlit)
    /// KHR_materials_clearcoat: a thin layer of lacquer, its share and its roughness.
    float clearcoat = 0.0f;
    float clearcoatRoughness = 0.0f;
    /// KHR_materials_transmission: how much light goes through. Drawn as transparent, without refraction.
    float transmission = 0.0f;
    /// kPhong: baseColor is diffuse, `specular` × `specularColor` the highlight's colour, `shininess` its exponent
    /// (Blinn's, as OpenGL's lights have it); metallic, roughness and `ior` say nothing.
    std::int64_t shading = kMetalRoughness;
    float specular = 1.0f;  ///< KHR_materials_specular: how much of what is no metal reflects, and tinted how
    Vec3f specularColor = Vec3f::Ones();
    float shininess = 32.0f;
    float ior =
        1.5f;  ///< KHR_materials_ior: Fresnel's reflection of what is no metal, ((ior - 1) / (ior + 1))² straight on
    /// kEdges: the triangles' edges alone, `lineWidth` wide. kCorners: their corners, `pointSize` wide. Both in pixels
    /// of the screen.
    std::int64_t fill = kFilled;
    float lineWidth = 1.0f;
    float pointSize = 3.0f;
    RefList layers;    ///< TextureLayers, in this order
    RefList passes;    ///< Materials that are drawn over this one, in this order; theirs are not followed
    ObjectId program;  ///< a SurfaceProgram
    RefList uniforms;  ///< Uniforms of the program
    /// A Material in place of this one where what bears it has a sphere of less than `coarserBelow` pixels on the
    /// screen; that one may have a coarser one.
    ObjectId coarser;
    double coarserBelow = 0;

    static constexpr std::int64_t kMetalRoughness = 0, kPhong = 1;
    static constexpr std::int64_t kFilled = 0, kEdges = 1, kCorners = 2;
    static constexpr std::size_t kMostLayers = 4, kMostPasses = 4, kMostUniforms = 16;
};
template <>
inline constexpr auto kSaid<Material> = []<typename T>(Describing<T>) {
    return describe(
               "Material", field<&T::baseColor>(1, "baseColor").lookBetween(0, 1),
               field<&T::metallic>(2, "metallic").lookBetween(0, 1),
               field<&T::roughness>(3, "roughness").lookBetween(0, 1),
               field<&T::emissive>(4, "emissive").lookBetween(0, 1e9),
               field<&T::baseColorImage>(5, "baseColorImage").to(typeOf<Image>()).affects(Effect::kLook),
               field<&T::doubleSided>(6, "doubleSided").affects(Effect::kLook),
               field<&T::alphaMode>(7, "alphaMode")
                   .oneOf({{Material::kAutoAlpha, "auto"},
                           {Material::kOpaque, "opaque"},
                           {Material::kMask, "mask"},
                           {Material::kBlend, "blend"}})
                   .affects(Effect::kLook),
               field<&T::alphaCutoff>(8, "alphaCutoff").lookBetween(0, 1e6),
               field<&T::metallicRoughnessImage>(9, "metallicRoughnessImage")
                   .to(typeOf<Image>())
                   .affects(Effect::kLook),
               field<&T::normalImage>(10, "normalImage").to(typeOf<Image>()).affects(Effect::kLook),
               field<&T::normalScale>(11, "normalScale").lookBetween(-1e3, 1e3),
               field<&T::occlusionImage>(12, "occlusionImage").to(typeOf<Image>()).affects(Effect::kLook),
               field<&T::occlusionStrength>(13, "occlusionStrength").lookBetween(0, 1),
               field<&T::emissiveImage>(14, "emissiveImage").to(typeOf<Image>()).affects(Effect::kLook),
               field<&T::unlit>(15, "unlit").affects(Effect::kLook),
               field<&T::clearcoat>(16, "clearcoat").lookBetween(0, 1),
               field<&T::clearcoatRoughness>(17, "clearcoatRoughness").lookBetween(0, 1),
               field<&T::transmission>(18, "transmission").lookBetween(0, 1),
               field<&T::shading>(19, "shading")
                   .oneOf({{Material::kMetalRoughness, "metal-roughness"}, {Material::kPhong, "phong"}})
                   .affects(Effect::kLook),
               field<&T::specular>(20, "specular").lookBetween(0, 1e3),
               field<&T::specularColor>(21, "specularColor").lookBetween(0, 1e3),
               field<&T::shininess>(22, "shininess").lookBetween(0, 1e4), field<&T::ior>(23, "ior").lookBetween(1, 100),
               field<&T::fill>(24, "fill")
                   .oneOf({{Material::kFilled, "filled"}, {Material::kEdges, "edges"}, {Material::kCorners, "corners"}})
                   .affects(Effect::kLook),
               field<&T::lineWidth>(25, "lineWidth").unit(Unit::kPixel).lookBetween(0.1, 64),
               field<&T::pointSize>(26, "pointSize").unit(Unit::kPixel).lookBetween(0.1, 64),
               field<&T::layers>(27, "layers").to(typeOf<TextureLayer>()).affects(Effect::kLook),
               field<&T::passes>(28, "passes").to(typeOf<Material>()).affects(Effect::kLook),
               field<&T::program>(29, "program").to(typeOf<SurfaceProgram>()).affects(Effect::kLook),
               field<&T::uniforms>(30, "uniforms").to(typeOf<Uniform>()).affects(Effect::kLook),
               field<&T::coarser>(31, "coarser").to(typeOf<Material>()).affects(Effect::kLook),
               field<&T::coarserBelow>(32, "coarserBelow").unit(Unit::kPixel).lookBetween(0, 1e6))
        .notACore();
};

}  // namespace tessera
