// Textures: an image, its sampler, its texture coordinates and its place on them become one Image of ours.

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

using ImageMessage = proto::scene::Image;

constexpr const char* kBasisExtension = "KHR_texture_basisu";

/// The images of a texture, the one to be shown first: what an extension names in place of `source`, then that.
std::vector<int> textureSources(const tinygltf::Model& model, int texture) {
    if (texture < 0 || static_cast<std::size_t>(texture) >= model.textures.size()) return {};
    const tinygltf::Texture& said = model.textures[static_cast<std::size_t>(texture)];
    std::vector<int> sources;
    for (const char* name : {"MSFT_texture_dds", kBasisExtension, "EXT_texture_webp"})
        if (const auto found = said.extensions.find(name); found != said.extensions.end())
            sources.push_back(static_cast<int>(std::clamp(gltfNumber(found->second, "source", -1), -1.0, 1e9)));
    sources.push_back(said.source);
    std::erase_if(sources,
                  [&](int source) { return source < 0 || static_cast<std::size_t>(source) >= model.images.size(); });
    return sources;
}

/// As people know it: its number, and its name or its file's.
std::string pictureName(const tinygltf::Model& model, int source) {
    const tinygltf::Image& image = model.images[static_cast<std::size_t>(source)];
    const std::string& called = image.name.empty() ? image.uri : image.name;
    return called.empty() || called.starts_with("data:") ? fmt::format("image {}", source)
                                                         : fmt::format("image {} '{}'", source, called.substr(0, 80));
}

ImageMessage::Wrap wrapOf(int wrap) {
    switch (wrap) {
        case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
            return ImageMessage::CLAMP;
        case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
            return ImageMessage::MIRROR;
        default:
            return ImageMessage::REPEAT;
    }
}

ImageMessage::Minification minificationOf(int filter) {
    switch (filter) {
        case TINYGLTF_TEXTURE_FILTER_NEAREST:
            return ImageMessage::NEAREST_ALONE;
        case TINYGLTF_TEXTURE_FILTER_LINEAR:
            return ImageMessage::LINEAR_ALONE;
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_NEAREST:
            return ImageMessage::NEAREST_MIPMAP_NEAREST;
        case TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_NEAREST:
            return ImageMessage::LINEAR_MIPMAP_NEAREST;
        case TINYGLTF_TEXTURE_FILTER_NEAREST_MIPMAP_LINEAR:
            return ImageMessage::NEAREST_MIPMAP_LINEAR;
        default:
            return ImageMessage::TRILINEAR;
    }
}

void setSampler(const tinygltf::Sampler& sampler, ImageMessage& image) {
    image.set_wrap_u(wrapOf(sampler.wrapS));
    image.set_wrap_v(wrapOf(sampler.wrapT));
    if (sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST) image.set_magnification(ImageMessage::NEAREST);
    image.set_minification(minificationOf(sampler.minFilter));
}

int integerIn(const tinygltf::Value& object, const char* key, int otherwise) {
    return static_cast<int>(std::clamp(gltfNumber(object, key, otherwise), -1.0, 1e9));
}

/// KHR_texture_transform, whose rotation is counter-clockwise as ours.
void setPlace(const tinygltf::Value& transform, ImageMessage& image) {
    image.set_texcoord_set(integerIn(transform, "texCoord", static_cast<int>(image.texcoord_set())));
    const Vec2d offset(gltfElement(transform, "offset", 0, 0), gltfElement(transform, "offset", 1, 0));
    const Vec2d scale(gltfElement(transform, "scale", 0, 1), gltfElement(transform, "scale", 1, 1));
    if (offset != Vec2d::Zero()) {
        image.mutable_offset()->set_x(offset.x());
        image.mutable_offset()->set_y(offset.y());
    }
    if (scale != Vec2d::Ones()) {
        image.mutable_scale()->set_x(scale.x());
        image.mutable_scale()->set_y(scale.y());
    }
    image.set_rotation_deg(static_cast<float>(gltfNumber(transform, "rotation", 0) * 180 / std::numbers::pi));
}

}  // namespace

double gltfNumber(const tinygltf::Value& object, const char* key, double otherwise) {
    return object.IsObject() && object.Has(key) && object.Get(key).IsNumber() ? object.Get(key).GetNumberAsDouble()
                                                                              : otherwise;
}

double gltfElement(const tinygltf::Value& object, const char* key, int index, double otherwise) {
    if (!object.IsObject() || !object.Has(key)) return otherwise;
    const tinygltf::Value& array = object.Get(key);
    if (!array.IsArray() || static_cast<std::size_t>(index) >= array.ArrayLen()) return otherwise;
    return array.Get(index).IsNumber() ? array.Get(index).GetNumberAsDouble() : otherwise;
}

GltfTextureUse::GltfTextureUse(const tinygltf::Value& info)
    : texture(integerIn(info, "index", -1)), texcoordSet(integerIn(info, "texCoord", 0)) {
    if (info.IsObject() && info.Has("extensions") && info.Get("extensions").Has(kTextureTransform))
        transform = &info.Get("extensions").Get(kTextureTransform);
}

std::string GltfReader::imageName(const GltfTextureUse& use) {
    if (use.texture < 0) return {};
    const std::vector<int> sources = textureSources(model_, use.texture);
    if (sources.empty()) {
        scene_.note("a texture without a readable image is left out");
        return {};
    }
    ImageMessage look;
    const int sampler = model_.textures[static_cast<std::size_t>(use.texture)].sampler;
    if (sampler >= 0 && static_cast<std::size_t>(sampler) < model_.samplers.size())
        setSampler(model_.samplers[static_cast<std::size_t>(sampler)], look);
    look.set_texcoord_set(use.texcoordSet);
    if (use.transform != nullptr) setPlace(*use.transform, look);
    if (look.texcoord_set() != 0 && look.texcoord_set() != 1) {
        scene_.note(fmt::format("textures at TEXCOORD_{} are left out", look.texcoord_set()));
        return {};
    }
    for (const int source : sources) {
        std::string& name = images_[{source, look.SerializeAsString()}];
        if (!name.empty()) return name;
        const std::string picture = fmt::format("image {}", source);
        const Expected<ImageMessage*> image =
            pictures_.addImage(fmt::format("image {}", images_.size() - 1), picture, [&]() -> Expected<DecodedImage> {
                // The image loader kept the file's own bytes; only textures in use are decoded.
                const tinygltf::Image& kept = model_.images[static_cast<std::size_t>(source)];
                const std::vector<unsigned char>& encoded = kept.image;
                if (encoded.empty() && !kept.uri.empty() && !kept.uri.starts_with("data:"))
                    if (const Expected<FolderFiles::Found> found = files_.find(kept.uri); !found)
                        return tl::unexpected(found.error());
                return pictures_.decode(std::as_bytes(std::span(encoded)));
            });
        if (!image) {
            const bool isLast = source == sources.back();
            const auto& extensions = model_.textures[static_cast<std::size_t>(use.texture)].extensions;
            if (isLast && extensions.contains(kBasisExtension))
                scene_.note(
                    fmt::format("{} is left out: {}; its texture ({}) names no other image: export the model "
                                "with PNG, JPEG or WebP pictures",
                                pictureName(model_, source), image.error().message, kBasisExtension));
            else
                scene_.note(fmt::format("{} is left out: {}", picture, image.error().message));
            continue;
        }
        name = (*image)->name();
        (*image)->MergeFrom(look);
        return name;
    }
    return {};
}

}  // namespace tessera
