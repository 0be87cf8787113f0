#include "common/export/GltfLooks.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/export/LeavingLooks.h"
#include "common/export/LeavingPictures.h"

namespace tessera {
namespace {

std::array<double, 3> threeOf(const Vec3f& color) {
    return {static_cast<double>(color[0]), static_cast<double>(color[1]), static_cast<double>(color[2])};
}

int wrapWord(std::int64_t wrap) {
    return wrap == Image::kClamp ? 33071 : wrap == Image::kMirror ? 33648 : 10497;
}

int minificationWord(std::int64_t filter) {
    switch (filter) {
        case Image::kNearestAlone:
            return 9728;
        case Image::kLinearAlone:
            return 9729;
        case Image::kNearestOfNearest:
            return 9984;
        case Image::kLinearOfNearest:
            return 9985;
        case Image::kNearestOfTwo:
            return 9986;
        default:
            return 9987;
    }
}

}  // namespace

int GltfLooks::material(ObjectId id, GltfCoordinates coordinates, ObjectId node) {
    const auto found = materials_.find({id, coordinates});
    if (found != materials_.end()) return found->second;
    const auto* known = id ? scene_.get<Material>(id) : nullptr;
    const int made = parts_.materials.add(describe(known ? *known : Material(), coordinates, node));
    materials_.emplace(std::pair(id, coordinates), made);
    return made;
}

void GltfLooks::describeReflection(const Material& m, JsonObject& pbr, JsonObject& extensions) {
    const auto extend = [&](const char* name, const JsonObject& members) {
        parts_.extensions.insert(name);
        extensions.json(name, members.done());
    };
    if (m.shading == Material::kPhong) {
        pbr.number("metallicFactor", 0).number("roughnessFactor", roughnessOfShininess(m.shininess));
    } else {
        pbr.number("metallicFactor", m.metallic).number("roughnessFactor", m.roughness);
    }
    if (m.unlit) return extend("KHR_materials_unlit", {});
    if (m.clearcoat > 0) {
        JsonObject coat;
        extend("KHR_materials_clearcoat",
               coat.number("clearcoatFactor", m.clearcoat).number("clearcoatRoughnessFactor", m.clearcoatRoughness));
    }
    if (m.transmission > 0) {
        JsonObject glass;
        extend("KHR_materials_transmission", glass.number("transmissionFactor", m.transmission));
    }
    if (m.specular != 1 || m.specularColor != Vec3f::Ones()) {
        // The factor ends at 1, the colour does not.
        const float over = std::max(m.specular, 1.0f);
        JsonObject specular;
        specular.number("specularFactor", m.specular / over);
        extend("KHR_materials_specular",
               specular.numbers("specularColorFactor", threeOf(Vec3f(over * m.specularColor))));
    }
    if (m.ior != 1.5f && m.shading != Material::kPhong) {
        JsonObject ior;
        extend("KHR_materials_ior", ior.number("ior", m.ior));
    }
}

std::string GltfLooks::describe(const Material& m, GltfCoordinates coordinates, ObjectId node) {
    noteLostLooks(m, notes_, node);
    JsonObject material, pbr, extensions;
    const std::array<double, 4> base{m.baseColor[0], m.baseColor[1], m.baseColor[2], m.baseColor[3]};
    pbr.numbers("baseColorFactor", base);
    describeReflection(m, pbr, extensions);
    if (const auto image = texture(m.baseColorImage, coordinates, node)) pbr.json("baseColorTexture", image->done());
    if (const auto image = texture(m.metallicRoughnessImage, coordinates, node))
        pbr.json("metallicRoughnessTexture", image->done());
    material.json("pbrMetallicRoughness", pbr.done());
    if (auto image = texture(m.normalImage, coordinates, node))
        material.json("normalTexture", image->number("scale", m.normalScale).done());
    if (auto image = texture(m.occlusionImage, coordinates, node))
        material.json("occlusionTexture", image->number("strength", m.occlusionStrength).done());
    if (const auto image = texture(m.emissiveImage, coordinates, node)) material.json("emissiveTexture", image->done());
    if (m.emissive != Vec3f::Zero()) {
        const float strength = std::max(m.emissive.maxCoeff(), 1.0f);
        // Never above 1, whatever is rounded.
        material.numbers("emissiveFactor", threeOf((m.emissive / strength).cwiseMin(1.0f)));
        if (strength > 1) {
            parts_.extensions.insert("KHR_materials_emissive_strength");
            JsonObject strong;
            extensions.json("KHR_materials_emissive_strength", strong.number("emissiveStrength", strength).done());
        }
    }
    const bool blends =
        m.alphaMode == Material::kBlend || (m.alphaMode == Material::kAutoAlpha && m.baseColor[3] < 1.0f);
    if (blends) material.text("alphaMode", "BLEND");
    if (m.alphaMode == Material::kMask) material.text("alphaMode", "MASK").number("alphaCutoff", m.alphaCutoff);
    if (m.doubleSided) material.json("doubleSided", "true");
    if (!extensions.empty()) material.json("extensions", extensions.done());
    return material.done();
}

std::optional<JsonObject> GltfLooks::texture(ObjectId id, GltfCoordinates coordinates, ObjectId node) {
    const auto* image = id ? scene_.get<Image>(id) : nullptr;
    if (!image || image->pixels.empty()) return std::nullopt;
    if (!(image->texcoordSet == 0 ? coordinates.first : coordinates.second)) {
        notes_.add("images of materials are left out where a mesh has no texture coordinates for them", node);
        return std::nullopt;
    }
    const std::optional<int> shown = picture(*image, node);
    if (!shown) return std::nullopt;
    const int how = sampler(*image);
    const auto [known, isNew] = textures_.try_emplace({*shown, how}, 0);
    if (isNew) {
        JsonObject made;
        known->second = parts_.textures.add(made.number("sampler", how).number("source", *shown).done());
    }
    JsonObject use;
    use.number("index", known->second);
    if (image->texcoordSet != 0) use.number("texCoord", image->texcoordSet);
    if (isPlaced(*image)) {
        JsonObject place, extension;
        if (image->offset != Vec2f::Zero()) place.numbers("offset", std::array{image->offset[0], image->offset[1]});
        if (image->rotation != 0) place.number("rotation", image->rotation);
        if (image->scale != Vec2f::Ones()) place.numbers("scale", std::array{image->scale[0], image->scale[1]});
        parts_.extensions.insert("KHR_texture_transform");
        use.json("extensions", extension.json("KHR_texture_transform", place.done()).done());
    }
    return use;
}

std::optional<int> GltfLooks::picture(const Image& image, ObjectId node) {
    const auto [known, isNew] = pictures_.try_emplace({image.pixels.id(), image.widthPx, image.heightPx}, std::nullopt);
    if (!isNew) return known->second;
    const std::optional<Bytes> png = pngOf(image, notes_, node);
    if (!png) return std::nullopt;
    JsonObject made;
    made.number("bufferView", parts_.addView(sliceOf(*png))).text("mimeType", "image/png");
    known->second = parts_.images.add(made.done());
    return known->second;
}

int GltfLooks::sampler(const Image& image) {
    JsonObject made;
    made.number("magFilter", image.magnification == Image::kNearest ? 9728 : 9729)
        .number("minFilter", minificationWord(image.minification))
        .number("wrapS", wrapWord(image.wrapU))
        .number("wrapT", wrapWord(image.wrapV));
    const auto [known, isNew] = samplers_.try_emplace(made.done(), 0);
    if (isNew) known->second = parts_.samplers.add(known->first);
    return known->second;
}

}  // namespace tessera
