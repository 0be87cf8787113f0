#include <fmt/format.h>

#include "server/import/reader/GltfReader.h"
#include "server/import/reader/ImageDecoder.h"

namespace tessera {
namespace {

float factor(const std::vector<double>& values, std::size_t index, float otherwise) {
    return index < values.size() ? static_cast<float>(values[index]) : otherwise;
}

/// A number in an extension's object, e.g. KHR_materials_emissive_strength.
double extensionNumber(const tinygltf::ExtensionMap& extensions, const char* extension, const char* key,
                       double otherwise) {
    const auto found = extensions.find(extension);
    if (found == extensions.end() || !found->second.Has(key) || !found->second.Get(key).IsNumber()) return otherwise;
    return found->second.Get(key).GetNumberAsDouble();
}

}  // namespace

Expected<std::string> GltfReader::materialName(int index) {
    if (index < 0) return std::string();
    if (static_cast<std::size_t>(index) >= model_.materials.size())
        return fail(ErrorCode::kBadInput, fmt::format("material {} does not exist", index));
    std::string name = fmt::format("material {}", index);
    if (!materials_.insert(index).second) return name;

    const tinygltf::Material& material = model_.materials[static_cast<std::size_t>(index)];
    const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
    const std::string image = imageName(pbr.baseColorTexture.index);
    Vec2d roughnessAndMetal(pbr.roughnessFactor, pbr.metallicFactor);
    if (pbr.metallicRoughnessTexture.index >= 0) {
        scene_.note("metal and roughness textures are averaged");
        roughnessAndMetal = roughnessAndMetal.cwiseProduct(meanRoughnessAndMetal(pbr.metallicRoughnessTexture.index));
    }

    proto::scene::Material* message = scene_.file.add_material();
    message->set_name(name);
    proto::scene::Color* color = message->mutable_base_color();
    color->set_r(factor(pbr.baseColorFactor, 0, 1.0f));
    color->set_g(factor(pbr.baseColorFactor, 1, 1.0f));
    color->set_b(factor(pbr.baseColorFactor, 2, 1.0f));
    // Alpha counts for blended materials only (glTF 2.0, "Alpha Coverage").
    if (material.alphaMode == "BLEND") color->set_a(factor(pbr.baseColorFactor, 3, 1.0f));
    if (material.alphaMode == "MASK") scene_.note("cut-out materials are drawn whole");
    message->set_roughness(static_cast<float>(roughnessAndMetal.x()));
    message->set_metallic(static_cast<float>(roughnessAndMetal.y()));
    message->set_base_color_image(image);
    message->set_double_sided(material.doubleSided);
    if (material.emissiveTexture.index >= 0) {
        // The factor alone would make all of it glow.
        scene_.note("emissive textures are left out");
    } else if (!material.emissiveFactor.empty()) {
        const auto strength = static_cast<float>(
            extensionNumber(material.extensions, "KHR_materials_emissive_strength", "emissiveStrength", 1.0));
        message->mutable_emissive()->set_r(factor(material.emissiveFactor, 0, 0.0f) * strength);
        message->mutable_emissive()->set_g(factor(material.emissiveFactor, 1, 0.0f) * strength);
        message->mutable_emissive()->set_b(factor(material.emissiveFactor, 2, 0.0f) * strength);
    }
    return name;
}

namespace {

/// The image of a texture, or -1.
int textureSource(const tinygltf::Model& model, int texture) {
    if (texture < 0 || static_cast<std::size_t>(texture) >= model.textures.size()) return -1;
    const int source = model.textures[static_cast<std::size_t>(texture)].source;
    return source >= 0 && static_cast<std::size_t>(source) < model.images.size() ? source : -1;
}

}  // namespace

std::string GltfReader::imageName(int texture) {
    const int source = textureSource(model_, texture);
    if (source < 0) {
        if (texture >= 0) scene_.note("a texture without a readable image is left out");
        return {};
    }
    if (const auto known = images_.find(source); known != images_.end()) return known->second;
    std::string& name = images_[source];
    // The image loader below kept the file's own bytes; only textures in use are decoded.
    const std::vector<unsigned char>& encoded = model_.images[static_cast<std::size_t>(source)].image;
    Expected<DecodedImage> image = decodeImage(std::as_bytes(std::span(encoded)), limits_.maxImageSide);
    if (!image) {
        scene_.note(fmt::format("image {} is left out: {}", source, image.error().message));
        return name;
    }
    if (image->halved)
        scene_.note(fmt::format("image {} was reduced to {} × {} pixels", source, image->widthPx, image->heightPx));
    name = fmt::format("image {}", source);
    scene_.addImage(name, image->widthPx, image->heightPx, std::move(image->rgba));
    return name;
}

Vec2d GltfReader::meanRoughnessAndMetal(int texture) {
    const int source = textureSource(model_, texture);
    if (source < 0) return Vec2d::Ones();
    const std::vector<unsigned char>& encoded = model_.images[static_cast<std::size_t>(source)].image;
    const Expected<DecodedImage> image = decodeImage(std::as_bytes(std::span(encoded)), limits_.maxImageSide);
    if (!image) return Vec2d::Ones();
    Vec2d sum = Vec2d::Zero();
    for (std::size_t i = 0; i + 4 <= image->rgba.size(); i += 4)
        sum += Vec2d(std::to_integer<int>(image->rgba[i + 1]), std::to_integer<int>(image->rgba[i + 2]));
    return sum / (255.0 * static_cast<double>(image->rgba.size() / 4));
}

}  // namespace tessera
