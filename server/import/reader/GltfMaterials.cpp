#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

constexpr const char* kSpecularGlossiness = "KHR_materials_pbrSpecularGlossiness";

const tinygltf::Value* extension(const tinygltf::Material& material, const char* name) {
    const auto found = material.extensions.find(name);
    return found == material.extensions.end() || !found->second.IsObject() ? nullptr : &found->second;
}

float share(const tinygltf::Value& object, const char* key, double otherwise, const BoundedNumbers& numbers) {
    return numbers.share(key, gltfNumber(object, key, otherwise), otherwise);
}

/// Whether an extension has a texture of this kind.
bool hasTexture(const tinygltf::Value& object, const char* key) {
    return object.Has(key) && GltfTextureUse(object.Get(key)).texture >= 0;
}

void setColor(const std::array<double, 4>& color, proto::scene::Color& message) {
    message.set_r(static_cast<float>(color[0]));
    message.set_g(static_cast<float>(color[1]));
    message.set_b(static_cast<float>(color[2]));
    message.set_a(static_cast<float>(color[3]));
}

/// glTF 2.0, "Alpha Coverage": of opaque materials alpha says nothing.
void setAlpha(const tinygltf::Material& material, const BoundedNumbers& numbers, proto::scene::Material& message) {
    if (material.alphaMode == "BLEND") {
        message.set_alpha_mode(proto::scene::Material::BLEND);
    } else if (material.alphaMode == "MASK") {
        message.set_alpha_mode(proto::scene::Material::MASK);
        message.set_alpha_cutoff(numbers.between(0, 1e6, "alphaCutoff", material.alphaCutoff, 0.5));
    } else {
        message.set_alpha_mode(proto::scene::Material::OPAQUE);
        message.mutable_base_color()->set_a(1.0f);
    }
}

void setEmissive(const tinygltf::Material& material, const BoundedNumbers& numbers, proto::scene::Color& message) {
    const tinygltf::Value* strong = extension(material, "KHR_materials_emissive_strength");
    const double strength =
        strong != nullptr ? numbers.between(0, 1e9, "emissiveStrength", gltfNumber(*strong, "emissiveStrength", 1.0), 1)
                          : 1.0;
    std::array<double, 4> color{0, 0, 0, 1};
    for (std::size_t i = 0; i < 3 && i < material.emissiveFactor.size(); ++i)
        color[i] = strength * numbers.share("emissiveFactor", material.emissiveFactor[i], 0);
    setColor(color, message);
}

}  // namespace

std::string GltfReader::defaultMaterialName(const tinygltf::Primitive& primitive) {
    if (!isSurface(primitive)) return {};
    std::string name = "default material";
    if (materials_.insert(-1).second) {
        proto::scene::Material& message = *scene_.file.add_material();
        message.set_name(name);
        setColor({1, 1, 1, 1}, *message.mutable_base_color());
        message.set_metallic(1);
        message.set_roughness(1);
        message.set_alpha_mode(proto::scene::Material::OPAQUE);
    }
    return name;
}

void GltfReader::setMetalRoughness(const tinygltf::PbrMetallicRoughness& pbr, const BoundedNumbers& numbers,
                                   proto::scene::Material& message) {
    std::array<double, 4> color{1, 1, 1, 1};
    std::copy_n(pbr.baseColorFactor.begin(), std::min<std::size_t>(4, pbr.baseColorFactor.size()), color.begin());
    for (double& part : color) part = numbers.share("baseColorFactor", part, 1);
    setColor(color, *message.mutable_base_color());
    message.set_metallic(numbers.share("metallicFactor", pbr.metallicFactor, 1));
    message.set_roughness(numbers.share("roughnessFactor", pbr.roughnessFactor, 1));
    message.set_base_color_image(imageName(pbr.baseColorTexture));
    message.set_metallic_roughness_image(imageName(pbr.metallicRoughnessTexture));
}

/// KHR_materials_pbrSpecularGlossiness, archived: what is left of it is a plastic of the diffuse colour.
void GltfReader::setSpecularGlossiness(const tinygltf::Value& old, const BoundedNumbers& numbers,
                                       proto::scene::Material& message) {
    scene_.note(fmt::format("{} is shown as a surface of its diffuse colour without metal{}", kSpecularGlossiness,
                            hasTexture(old, "specularGlossinessTexture") ? "; its other texture is left out" : ""));
    std::array<double, 4> color{};
    for (std::size_t i = 0; i < 4; ++i)
        color[i] = numbers.share("diffuseFactor", gltfElement(old, "diffuseFactor", static_cast<int>(i), 1.0), 1);
    setColor(color, *message.mutable_base_color());
    message.set_metallic(0);
    message.set_roughness(1 - share(old, "glossinessFactor", 1, numbers));
    if (old.Has("diffuseTexture")) message.set_base_color_image(imageName(GltfTextureUse(old.Get("diffuseTexture"))));
}

void GltfReader::setCoatAndTransmission(const tinygltf::Material& material, const BoundedNumbers& numbers,
                                        proto::scene::Material& message) {
    if (const tinygltf::Value* coat = extension(material, "KHR_materials_clearcoat")) {
        message.set_clearcoat(share(*coat, "clearcoatFactor", 0, numbers));
        message.set_clearcoat_roughness(share(*coat, "clearcoatRoughnessFactor", 0, numbers));
        for (const char* texture : {"clearcoatTexture", "clearcoatRoughnessTexture", "clearcoatNormalTexture"})
            if (hasTexture(*coat, texture)) scene_.note(fmt::format("{} is left out", texture));
    }
    if (const tinygltf::Value* glass = extension(material, "KHR_materials_transmission")) {
        message.set_transmission(share(*glass, "transmissionFactor", 0, numbers));
        if (hasTexture(*glass, "transmissionTexture")) scene_.note("transmissionTexture is left out");
    }
}

void GltfReader::setSpecular(const tinygltf::Material& material, const BoundedNumbers& numbers,
                             proto::scene::Material& message) {
    if (const tinygltf::Value* specular = extension(material, "KHR_materials_specular")) {
        message.set_specular(share(*specular, "specularFactor", 1, numbers));
        std::array<double, 4> color{1, 1, 1, 1};
        for (std::size_t i = 0; i < 3; ++i)
            color[i] = numbers.between(0, 1e3, "specularColorFactor",
                                       gltfElement(*specular, "specularColorFactor", static_cast<int>(i), 1.0), 1);
        setColor(color, *message.mutable_specular_color());
        for (const char* texture : {"specularTexture", "specularColorTexture"})
            if (hasTexture(*specular, texture)) scene_.note(fmt::format("{} is left out", texture));
    }
    if (const tinygltf::Value* ior = extension(material, "KHR_materials_ior")) {
        // 0 stands for one beyond all bounds: everything is reflected.
        const double said = gltfNumber(*ior, "ior", 1.5);
        message.set_ior(said == 0 ? 100.0f : numbers.between(1, 100, "ior", said, 1.5));
    }
}

Expected<std::string> GltfReader::materialName(const tinygltf::Primitive& primitive) {
    const int index = primitive.material;
    if (index < 0) return defaultMaterialName(primitive);
    if (static_cast<std::size_t>(index) >= model_.materials.size())
        return fail(ErrorCode::kBadInput, fmt::format("material {} does not exist", index));
    std::string name = fmt::format("material {}", index);
    if (!materials_.insert(index).second) return name;

    const tinygltf::Material& material = model_.materials[static_cast<std::size_t>(index)];
    for (const auto& [used, value] : material.extensions) noteExtension(used);
    proto::scene::Material message;
    message.set_name(name);
    const BoundedNumbers numbers(
        scene_, material.name.empty() ? name : fmt::format("{} '{}'", name, material.name.substr(0, 80)));
    if (const tinygltf::Value* old = extension(material, kSpecularGlossiness))
        setSpecularGlossiness(*old, numbers, message);
    else
        setMetalRoughness(material.pbrMetallicRoughness, numbers, message);
    setAlpha(material, numbers, message);
    message.set_double_sided(material.doubleSided);
    message.set_normal_image(imageName(material.normalTexture));
    message.set_normal_scale(numbers.between(-1e3, 1e3, "normalTexture.scale", material.normalTexture.scale, 1));
    message.set_occlusion_image(imageName(material.occlusionTexture));
    message.set_occlusion_strength(numbers.share("occlusionTexture.strength", material.occlusionTexture.strength, 1));
    message.set_emissive_image(imageName(material.emissiveTexture));
    setEmissive(material, numbers, *message.mutable_emissive());
    message.set_unlit(material.extensions.count("KHR_materials_unlit") > 0);
    setCoatAndTransmission(material, numbers, message);
    setSpecular(material, numbers, message);
    *scene_.file.add_material() = std::move(message);
    return name;
}

}  // namespace tessera
