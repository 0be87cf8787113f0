#include "server/import/reader/AssimpMaterials.h"

#include <assimp/GltfMaterial.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "server/import/reader/BoundedNumbers.h"
#include "server/import/reader/PictureChannels.h"

namespace tessera {
namespace {

using ImageMessage = proto::scene::Image;

std::string textureFile(const aiMaterial& material, aiTextureType kind) {
    aiString file;
    return material.GetTexture(kind, 0, &file) == aiReturn_SUCCESS ? file.C_Str() : "";
}

ImageMessage::Wrap mapModeOf(int mode) {
    return mode == aiTextureMapMode_Mirror ? ImageMessage::MIRROR
           : mode == aiTextureMapMode_Wrap
               ? ImageMessage::REPEAT
               : ImageMessage::CLAMP;  // a decal, too: what is around it is none of its pixels
}

template <typename T>
T property(const aiMaterial& material, const char* key, unsigned kind, unsigned index, T otherwise) {
    T value = otherwise;
    return material.Get(key, kind, index, value) == aiReturn_SUCCESS ? value : otherwise;
}

/// Assimp's origin is the lower left corner of the picture, ours the upper left one; its v moves were turned around
/// with the coordinates themselves, its v scales were not.
void setTextureTransform(const aiUVTransform& transform, ImageMessage& image) {
    const double scaleV = transform.mScaling.y;
    const double offsetU = transform.mTranslation.x, offsetV = 1.0 - scaleV + transform.mTranslation.y;
    if (offsetU != 0 || offsetV != 0) {
        image.mutable_offset()->set_x(offsetU);
        image.mutable_offset()->set_y(offsetV);
    }
    if (transform.mScaling.x != 1 || scaleV != 1) {
        image.mutable_scale()->set_x(transform.mScaling.x);
        image.mutable_scale()->set_y(scaleV);
    }
}

DecodedImage barePixels(const aiTexture& texture) {
    DecodedImage image;
    image.widthPx = static_cast<int>(texture.mWidth);
    image.heightPx = static_cast<int>(texture.mHeight);
    for (const aiTexel& texel : std::span(texture.pcData, std::size_t{texture.mWidth} * texture.mHeight))
        for (const unsigned char part : {texel.r, texel.g, texel.b, texel.a}) image.rgba.push_back(std::byte{part});
    return image;
}

/// What assimp gives where a file says nothing: one of a known name, and of PLY one without a name, white. Colours of
/// corners are as they are on white alone.
bool isMadeUp(const aiScene& source, unsigned index) {
    const aiMaterial& material = *source.mMaterials[index];
    aiString name;
    if (material.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS && name.length > 0)
        return std::strcmp(name.C_Str(), AI_DEFAULT_MATERIAL_NAME) == 0;
    aiColor4D color(1, 1, 1, 1);
    material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
    for (const aiTextureType type : {aiTextureType_DIFFUSE, aiTextureType_BASE_COLOR})
        if (material.GetTextureCount(type) > 0) return false;
    for (unsigned m = 0; m < source.mNumMeshes; ++m)
        if (source.mMeshes[m]->mMaterialIndex == index && source.mMeshes[m]->HasVertexColors(0)) return false;
    return color == aiColor4D(1, 1, 1, 1);
}

bool isBlack(const proto::scene::Color& color) {
    return color.r() == 0 && color.g() == 0 && color.b() == 0;
}

}  // namespace

std::string AssimpMaterials::name(unsigned index) {
    if (index >= source_.mNumMaterials) return {};
    std::string name = fmt::format("material {}", index);
    if (!materials_.insert(index).second) return name;
    const aiMaterial& material = *source_.mMaterials[index];
    proto::scene::Material message;
    message.set_name(name);
    message.set_double_sided(sidesUnknown_ || property(material, AI_MATKEY_TWOSIDED, 0) != 0);
    if (!isMadeUp(source_, index)) {
        setColors(material, message);
        setTextures(material, message);
    }
    *scene_.file.add_material() = std::move(message);
    return name;
}

void AssimpMaterials::setColors(const aiMaterial& material, proto::scene::Material& message) {
    aiString called;
    material.Get(AI_MATKEY_NAME, called);
    const BoundedNumbers numbers(
        scene_, fmt::format("{} '{}'", message.name(), std::string_view(called.C_Str()).substr(0, 80)));
    const auto set = [&](std::string_view name, const auto& from, double most, double otherwise,
                         proto::scene::Color& to) {
        to.set_r(numbers.between(0, most, name, from.r, otherwise));
        to.set_g(numbers.between(0, most, name, from.g, otherwise));
        to.set_b(numbers.between(0, most, name, from.b, otherwise));
    };
    aiColor4D color(0.8f, 0.8f, 0.8f, 1.0f);
    if (material.Get(AI_MATKEY_BASE_COLOR, color) != aiReturn_SUCCESS) material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
    float opacity = property(material, AI_MATKEY_OPACITY, 1.0f);
    // Exporters that mix up "d" and "Tr" would make everything vanish.
    if (!(opacity > 0.0f)) opacity = 1.0f;
    set("the colour", color, 1, 0.8, *message.mutable_base_color());
    message.mutable_base_color()->set_a(std::min(opacity, 1.0f));
    if (opacity < 1.0f) message.set_alpha_mode(proto::scene::Material::BLEND);
    aiColor3D emissive(0.0f, 0.0f, 0.0f);
    if (material.Get(AI_MATKEY_COLOR_EMISSIVE, emissive) == aiReturn_SUCCESS)
        set("the glow", emissive, 1e9, 0, *message.mutable_emissive());
    float number = 0.0f;
    if (material.Get(AI_MATKEY_METALLIC_FACTOR, number) == aiReturn_SUCCESS)
        message.set_metallic(numbers.share("the metal", number, 0));
    if (material.Get(AI_MATKEY_ROUGHNESS_FACTOR, number) == aiReturn_SUCCESS)
        message.set_roughness(numbers.share("the roughness", number, 0.6));
    else if (material.Get(AI_MATKEY_SHININESS, number) == aiReturn_SUCCESS && number > 0.0f)
        // The Blinn-Phong exponent whose highlight is about as wide (Karis 2013: n = 2 / alpha² - 2, alpha =
        // roughness²).
        message.set_roughness(std::clamp(std::pow(2.0f / (number + 2.0f), 0.25f), 0.05f, 1.0f));
}

void AssimpMaterials::setTextures(const aiMaterial& material, proto::scene::Material& message) {
    std::set<aiTextureType> taken;
    message.set_base_color_image(image(material, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}, taken));
    message.set_normal_image(image(material, {aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA}, taken));
    message.set_occlusion_image(image(material, {aiTextureType_AMBIENT_OCCLUSION}, taken));
    message.set_emissive_image(image(material, {aiTextureType_EMISSIVE, aiTextureType_EMISSION_COLOR}, taken));
    // Where a texture glows, files leave the colour beside it black, and would have it dark here.
    if (!message.emissive_image().empty() && isBlack(message.emissive()))
        for (const auto set : {&proto::scene::Color::set_r, &proto::scene::Color::set_g, &proto::scene::Color::set_b})
            (message.mutable_emissive()->*set)(1.0f);
    setMetalRoughness(material, message, taken);
    // A picture that is colour and opacity at once says the latter by its alpha.
    const std::string opacity = textureFile(material, aiTextureType_OPACITY);
    for (const aiTextureType base : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
        const int flags = property(material, _AI_MATKEY_TEXFLAGS_BASE, base, 0, 0);
        const bool same = !opacity.empty() && opacity == textureFile(material, base);
        if (same) taken.insert(aiTextureType_OPACITY);
        if (taken.count(base) > 0 && (same || (flags & aiTextureFlags_UseAlpha) != 0))
            message.set_alpha_mode(proto::scene::Material::BLEND);
    }
    noteOthers(material, taken);
}

void AssimpMaterials::setMetalRoughness(const aiMaterial& material, proto::scene::Material& message,
                                        std::set<aiTextureType>& taken) {
    const std::string metal = textureFile(material, aiTextureType_METALNESS);
    const std::string roughness = textureFile(material, aiTextureType_DIFFUSE_ROUGHNESS);
    if (metal.empty() && roughness.empty()) return;
    taken.insert({aiTextureType_METALNESS, aiTextureType_DIFFUSE_ROUGHNESS});
    // One picture for both is laid out as glTF's; two become such a one, by the coordinates of the first.
    const std::optional<ImageMessage> wanted =
        look(material, metal.empty() ? aiTextureType_DIFFUSE_ROUGHNESS : aiTextureType_METALNESS);
    if (!wanted) return;
    message.set_metallic_roughness_image(
        metal == roughness ? imageOf("texture " + metal, *wanted, [&] { return decode(metal); })
                           : imageOf(fmt::format("the texture of metal '{}' and roughness '{}'", metal, roughness),
                                     *wanted, [&] { return decodePacked(metal, roughness); }));
    if (message.metallic_roughness_image().empty()) return;
    // The numbers multiply the picture. Where files say none, or 0, they mean the picture alone.
    if (!metal.empty() && message.metallic() == 0) message.set_metallic(1);
    if (!roughness.empty() && property(material, AI_MATKEY_ROUGHNESS_FACTOR, 0.0f) == 0) message.set_roughness(1);
}

void AssimpMaterials::noteOthers(const aiMaterial& material, const std::set<aiTextureType>& taken) {
    for (int i = 1; i <= AI_TEXTURE_TYPE_MAX; ++i) {
        const auto kind = static_cast<aiTextureType>(i);
        const unsigned shown = taken.count(kind) > 0 ? 1 : 0;
        if (material.GetTextureCount(kind) > shown)
            scene_.note(fmt::format("textures of kind {} are left out{}", aiTextureTypeToString(kind),
                                    shown > 0 ? " beyond the first" : ""));
    }
}

std::string AssimpMaterials::image(const aiMaterial& material, std::initializer_list<aiTextureType> kinds,
                                   std::set<aiTextureType>& taken) {
    for (const aiTextureType kind : kinds) {
        const std::string file = textureFile(material, kind);
        if (file.empty()) continue;
        taken.insert(kind);
        const std::optional<ImageMessage> wanted = look(material, kind);
        return wanted ? imageOf("texture " + file, *wanted, [&] { return decode(file); }) : "";
    }
    return {};
}

std::string AssimpMaterials::imageOf(const std::string& picture, const ImageMessage& wanted,
                                     const std::function<Expected<DecodedImage>()>& decode) {
    std::string& name = images_[{picture, wanted.SerializeAsString()}];
    if (!name.empty()) return name;
    const Expected<ImageMessage*> added =
        pictures_.addImage(fmt::format("image {}", images_.size() - 1), picture, decode);
    if (!added) {
        scene_.note(fmt::format("{} is left out: {}", picture, added.error().message));
        return {};
    }
    name = (*added)->name();
    (*added)->MergeFrom(wanted);
    return name;
}

std::optional<ImageMessage> AssimpMaterials::look(const aiMaterial& material, aiTextureType kind) {
    ImageMessage image;
    const int set = property(material, _AI_MATKEY_UVWSRC_BASE, kind, 0, 0);
    if (set != 0 && set != 1) {
        scene_.note(fmt::format("textures at texture coordinates {} are left out", set));
        return std::nullopt;
    }
    if (property(material, _AI_MATKEY_MAPPING_BASE, kind, 0, int{aiTextureMapping_UV}) != aiTextureMapping_UV)
        scene_.note("a texture that is projected is shown by the mesh's own texture coordinates");
    image.set_texcoord_set(set);
    image.set_wrap_u(mapModeOf(property(material, _AI_MATKEY_MAPPINGMODE_U_BASE, kind, 0, int{aiTextureMapMode_Wrap})));
    image.set_wrap_v(mapModeOf(property(material, _AI_MATKEY_MAPPINGMODE_V_BASE, kind, 0, int{aiTextureMapMode_Wrap})));
    aiUVTransform transform;
    if (material.Get(_AI_MATKEY_UVTRANSFORM_BASE, kind, 0, transform) == aiReturn_SUCCESS) {
        if (transform.mRotation != 0) scene_.note("turned textures are shown as if they were not");
        setTextureTransform(transform, image);
    }
    return image;
}

Expected<DecodedImage> AssimpMaterials::decode(const std::string& file) {
    const aiTexture* embedded = source_.GetEmbeddedTexture(file.c_str());
    if (embedded == nullptr) {
        std::string slashes = file;
        std::replace(slashes.begin(), slashes.end(), '\\', '/');
        const Expected<FolderFiles::Found> found = files_.find(slashes);
        if (!found) return tl::unexpected(found.error());
        if (!found->note.empty()) scene_.note("a texture: " + found->note);
        const Expected<Bytes> bytes = files_.readFound(*found);
        if (!bytes) return tl::unexpected(bytes.error());
        return pictures_.decode(*bytes);
    }
    const auto* data = reinterpret_cast<const std::byte*>(embedded->pcData);
    if (embedded->mHeight == 0) return pictures_.decode(ByteSpan(data, embedded->mWidth));
    DecodedImage image = barePixels(*embedded);
    while (std::max(image.widthPx, image.heightPx) > limits_.maxImageSide && halve(image)) {
    }
    return image;
}

Expected<DecodedImage> AssimpMaterials::decodePacked(const std::string& metal, const std::string& roughness) {
    std::vector<PictureChannel> channels;  // glTF's green and blue
    for (const auto& [channel, file] : {std::pair<int, const std::string&>(1, roughness), {2, metal}}) {
        if (file.empty()) continue;
        Expected<DecodedImage> part = decode(file);
        if (!part) return part;
        channels.push_back({std::move(*part), 0, channel});
    }
    return joinedChannels(std::move(channels));
}

}  // namespace tessera
