#include "server/import/reader/UsdMaterials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/Srgb.h"
#include "server/import/reader/PictureChannels.h"
#include "server/import/reader/UsdPrimvars.h"

namespace tessera {
namespace {

using UsdImage = proto::scene::Image;

constexpr int kDeepestUsdConnection = 16;

/// A path's prim, and its property behind the dot.
std::pair<std::string, std::string> primAndProperty(const std::string& path) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos) return {path, {}};
    return {path.substr(0, dot), path.substr(dot + 1)};
}

UsdImage::Wrap usdWrapOf(const std::string& word) {
    if (word == "clamp" || word == "black") return UsdImage::CLAMP;
    return word == "mirror" ? UsdImage::MIRROR : UsdImage::REPEAT;
}

/// Whether the file says of a picture that its bytes are other than what is wanted: linear ones of colours, or sRGB of
/// what is none.
bool isRecoded(const UsdComposedPrim& texture, bool colors) {
    return usdWord(texture, "inputs:sourceColorSpace", "auto") == (colors ? "raw" : "sRGB");
}

/// Bytes in sRGB of linear ones, or the other way; alpha is no colour.
void recode(DecodedImage& picture, bool toSrgb) {
    if (picture.encoding != UsdImage::SRGB) return;  // blocks and floats stay
    std::array<std::byte, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
        const float share = static_cast<float>(i) / 255;
        const float made = toSrgb ? srgbOfLinear(share) : linearOfSrgb(share);
        table[i] = static_cast<std::byte>(std::lround(std::clamp(made, 0.0F, 1.0F) * 255));
    }
    for (std::size_t i = 0; i < picture.rgba.size(); ++i)
        if (i % 4 != 3) picture.rgba[i] = table[std::to_integer<std::size_t>(picture.rgba[i])];
}

int usdChannelOf(const std::string& name) {
    return name == "g" ? 1 : name == "b" ? 2 : name == "a" ? 3 : 0;
}

/// What "inputs:scale" or "inputs:bias" says of a channel.
double channelOf(const UsdComposedPrim& texture, const std::string& input, const std::string& name, double otherwise) {
    const std::vector<double> all = usdNumbers(texture, input);
    const auto channel = static_cast<std::size_t>(usdChannelOf(name));
    return channel < all.size() && std::isfinite(all[channel]) ? all[channel] : otherwise;
}

}  // namespace

std::string usdBoundMaterial(const UsdComposedPrim& prim) {
    for (const char* name : {"material:binding:preview", "material:binding", "material:binding:full"})
        if (std::vector<std::string> targets = prim.targets(name); !targets.empty()) return targets.front();
    return {};
}

bool usdHasCollections(const UsdComposedPrim& prim) {
    constexpr std::string_view kPrefix = "material:binding:collection";
    return std::ranges::any_of(prim.opinions(), [&](const UsdOpinion& opinion) {
        const auto said = opinion.prim->properties.lower_bound(kPrefix);
        return said != opinion.prim->properties.end() && said->first.starts_with(kPrefix);
    });
}

UsdLook UsdMaterials::colored(bool doubleSided, bool transparent) {
    const std::string name =
        fmt::format("{}{}{}", kColored, doubleSided ? ", two-sided" : "", transparent ? ", transparent" : "");
    UsdLook& look = known_[{"\n" + name, doubleSided}];
    if (look.material.empty()) {
        proto::scene::Material& message = *scene_.file.add_material();
        message.set_name(name);
        message.set_double_sided(doubleSided);
        for (const auto set : {&proto::scene::Color::set_r, &proto::scene::Color::set_g, &proto::scene::Color::set_b})
            (message.mutable_base_color()->*set)(1.0F);
        message.set_metallic(0);
        message.set_roughness(0.5F);
        message.set_alpha_mode(transparent ? proto::scene::Material::BLEND : proto::scene::Material::OPAQUE);
        look.material = name;
    }
    return look;
}

Expected<std::string> UsdMaterials::fingerprint(const UsdComposedPrim& prim, const std::string& material, int depth) {
    std::string print = prim.type();
    for (const std::string& name : prim.propertyNames()) {
        const std::optional<UsdAttribute> attribute = prim.attribute(name);
        print +=
            fmt::format("\n{} {}", name, fmt::ptr(attribute && attribute->value ? attribute->value.get() : nullptr));
        for (const std::string& target : prim.targets(name))
            print += " " + (target.starts_with(material) ? target.substr(material.size()) : target);
    }
    if (depth >= kDeepestUsdConnection) return print;
    for (const std::string& name : prim.childNames()) {
        const Expected<UsdStage::Prim> child = stage_.child(prim, name);
        if (!child) return tl::unexpected(child.error());
        const Expected<std::string> below = fingerprint(**child, material, depth + 1);
        if (!below) return below;
        print += "\n{" + name + " " + *below + "}";
        if (print.size() > (std::size_t{1} << 20)) break;  // no material, whatever it is
    }
    return print;
}

Expected<UsdLook> UsdMaterials::look(const std::string& path, bool doubleSided) {
    if (const auto known = known_.find({path, doubleSided}); known != known_.end()) return known->second;
    const Expected<UsdStage::Prim> material = stage_.at(path);
    if (!material) return tl::unexpected(material.error());
    UsdLook look;
    if (!*material || (*material)->type() != "Material") {
        remarks_.add("materials that are bound and not there are left out", path);
        return known_[{path, doubleSided}] = look;
    }
    const Expected<std::string> print = fingerprint(**material, path, 0);
    if (!print) return tl::unexpected(print.error());
    if (const auto same = sameAs_.find({*print, doubleSided}); same != sameAs_.end())
        return known_[{path, doubleSided}] = same->second;
    const Expected<UsdStage::Prim> surface = surfaceOf(**material);
    if (!surface) return tl::unexpected(surface.error());
    if (!*surface) {
        remarks_.add("materials without a UsdPreviewSurface, as those of MaterialX alone, are left out", path);
        return known_[{path, doubleSided}] = look;
    }
    proto::scene::Material message;
    message.set_name(fmt::format("material {}", scene_.file.material_size()));
    message.set_double_sided(doubleSided);
    if (Expected<void> done = setSurface(**surface, look, message); !done) return tl::unexpected(done.error());
    look.material = message.name();
    *scene_.file.add_material() = std::move(message);
    sameAs_[{*print, doubleSided}] = look;
    return known_[{path, doubleSided}] = look;
}

Expected<UsdStage::Prim> UsdMaterials::surfaceOf(const UsdComposedPrim& material) {
    Expected<UsdStage::Prim> shader = shaderOf(material, "outputs:surface");
    if (shader && *shader && usdWord(**shader, "info:id", "") != "UsdPreviewSurface") return UsdStage::Prim();
    return shader;
}

Expected<UsdMaterials::Input> UsdMaterials::input(const UsdComposedPrim& shader, const std::string& name, int depth) {
    Input input;
    const std::string full = "inputs:" + name;
    if (const std::optional<UsdAttribute> own = shader.attribute(full)) input.value = own->value;
    std::vector<std::string> targets = shader.targets(full);
    for (; depth < kDeepestUsdConnection && !targets.empty(); ++depth) {
        const auto [path, property] = primAndProperty(targets.front());
        const Expected<UsdStage::Prim> prim = stage_.at(path);
        if (!prim) return tl::unexpected(prim.error());
        if (!*prim) break;
        const std::string id = (*prim)->type() == "Shader" ? usdWord(**prim, "info:id", "") : "";
        if (id == "UsdUVTexture") {
            input.texture = *prim;
            input.channel = property.starts_with("outputs:") ? property.substr(8) : "rgb";
            return input;
        }
        if (id.starts_with("UsdPrimvarReader")) {
            const Expected<Input> varname = this->input(**prim, "varname", depth + 1);
            if (!varname) return varname;
            if (varname->value && varname->value->word()) input.primvar = *varname->value->word();
            return input;
        }
        if (!id.empty()) {
            remarks_.add(fmt::format("shaders {} are left out", id), path);
            return input;
        }
        // Of a material, or a graph of nodes: its value, or what that is connected to.
        if (const std::optional<UsdAttribute> passed = (*prim)->attribute(property); passed && passed->value)
            input.value = passed->value;
        targets = (*prim)->targets(property);
    }
    return input;
}

Expected<UsdStage::Prim> UsdMaterials::shaderOf(const UsdComposedPrim& prim, const std::string& property) {
    std::vector<std::string> targets = prim.targets(property);
    for (int depth = 0; depth < kDeepestUsdConnection && !targets.empty(); ++depth) {
        const auto [path, next] = primAndProperty(targets.front());
        const Expected<UsdStage::Prim> found = stage_.at(path);
        if (!found || !*found || (*found)->type() == "Shader") return found;
        targets = (*found)->targets(next);
    }
    return UsdStage::Prim();
}

Expected<std::optional<UsdImage>> UsdMaterials::place(const UsdComposedPrim& texture, UsdLook& look) {
    UsdImage image;
    for (const auto& [name, set] : {std::pair("wrapS", &UsdImage::set_wrap_u), {"wrapT", &UsdImage::set_wrap_v}}) {
        const Expected<Input> wrap = input(texture, name);
        if (!wrap) return tl::unexpected(wrap.error());
        (image.*set)(usdWrapOf(wrap->value && wrap->value->word() ? *wrap->value->word() : ""));
    }
    // From the texture back to the primvar, with a move between.
    std::string primvar = "st";
    Expected<UsdStage::Prim> source = shaderOf(texture, "inputs:st");
    if (!source) return tl::unexpected(source.error());
    if (*source && usdWord(**source, "info:id", "") == "UsdTransform2d") {
        const auto two = [&](const char* name, double otherwise) {
            const std::vector<double> said = usdNumbers(**source, name);
            return said.size() == 2 && std::isfinite(said[0]) && std::isfinite(said[1]) ? Vec2d(said[0], said[1])
                                                                                        : Vec2d(otherwise, otherwise);
        };
        const Vec2d scale = two("inputs:scale", 1), move = two("inputs:translation", 0);
        const std::vector<double> turn = usdNumbers(**source, "inputs:rotation");
        const double degrees = turn.size() == 1 && std::isfinite(turn[0]) ? turn[0] : 0;
        const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
        // There v grows upwards from the picture's lower edge, here downwards from its upper one.
        image.mutable_offset()->set_x(move.x() - s * scale.y());
        image.mutable_offset()->set_y(1 - c * scale.y() - move.y());
        image.mutable_scale()->set_x(scale.x());
        image.mutable_scale()->set_y(scale.y());
        image.set_rotation_deg(static_cast<float>(degrees));
        const UsdStage::Prim transform = *source;
        source = shaderOf(*transform, "inputs:in");
        if (!source) return tl::unexpected(source.error());
    }
    if (*source && usdWord(**source, "info:id", "").starts_with("UsdPrimvarReader")) {
        const Expected<Input> name = input(**source, "varname");
        if (!name) return tl::unexpected(name.error());
        if (name->value && name->value->word() && !name->value->word()->empty()) primvar = *name->value->word();
    }
    for (std::size_t set = 0; set < 2; ++set) {
        if (look.texcoords[set].empty()) look.texcoords[set] = primvar;
        if (look.texcoords[set] != primvar) continue;
        image.set_texcoord_set(static_cast<std::int64_t>(set));
        return std::optional(image);
    }
    remarks_.add("textures at a third set of texture coordinates are left out", texture.path());
    return std::optional<UsdImage>();
}

Expected<DecodedImage> UsdMaterials::decode(const UsdComposedPrim& texture, Holds holds) {
    const std::optional<UsdAttribute> file = texture.attribute("inputs:file");
    if (!file || !file->value || !file->value->word() || file->layer == nullptr)
        return fail(ErrorCode::kNotFound, "it names no file");
    const std::string& asset = *file->value->word();
    if (asset.find("<UDIM>") != std::string::npos)
        return fail(ErrorCode::kUnsupported, fmt::format("'{}' stands for many pictures (UDIM)", asset));
    const Expected<Bytes> bytes = files_.bytes(asset, file->layer->identifier);
    if (!bytes) return tl::unexpected(bytes.error());
    Expected<DecodedImage> picture = pictures_.decode(*bytes);
    if (picture && isRecoded(texture, holds == Holds::kColors)) recode(*picture, holds == Holds::kColors);
    return picture;
}

std::string UsdMaterials::imageOf(const std::string& picture, const UsdImage& wanted,
                                  const std::function<Expected<DecodedImage>()>& decode) {
    std::string& name = images_[{picture, wanted.SerializeAsString()}];
    if (!name.empty()) return name;
    const Expected<UsdImage*> added = pictures_.addImage(fmt::format("image {}", images_.size() - 1), picture, decode);
    if (!added) {
        remarks_.add("textures are left out", fmt::format("{}: {}", picture, added.error().message));
        return {};
    }
    name = (*added)->name();
    (*added)->MergeFrom(wanted);
    return name;
}

Expected<UsdMaterials::Texture> UsdMaterials::texture(const Input& input, UsdLook& look, Holds holds) {
    Texture texture;
    const std::optional<UsdAttribute> file = input.texture->attribute("inputs:file");
    texture.file = file && file->value && file->value->word() && file->layer
                       ? UsdFiles::identifierOf(*file->value->word(), file->layer->identifier)
                       : input.texture->path();
    for (const auto& [name, to] : {std::pair("inputs:scale", &texture.scale), {"inputs:bias", &texture.bias}}) {
        const std::vector<double> said = usdNumbers(*input.texture, name);
        for (std::size_t i = 0; i < 4 && i < said.size(); ++i)
            if (std::isfinite(said[i])) (*to)[i] = said[i];
    }
    const auto wanted = place(*input.texture, look);
    if (!wanted) return tl::unexpected(wanted.error());
    const bool recoded = isRecoded(*input.texture, holds == Holds::kColors);
    if (*wanted)
        texture.image = imageOf(fmt::format("texture {}{}", texture.file,
                                            !recoded                  ? ""
                                            : holds == Holds::kColors ? " in sRGB"
                                                                      : " made linear"),
                                **wanted, [&] { return decode(*input.texture, holds); });
    return texture;
}

std::string UsdMaterials::surroundings(const UsdAttribute& file, const std::string& prim) {
    if (!file.value || !file.value->word() || file.value->word()->empty() || file.layer == nullptr) return {};
    const std::string asset = *file.value->word();
    return imageOf("the surroundings of " + prim, {}, [&]() -> Expected<DecodedImage> {
        const Expected<Bytes> bytes = files_.bytes(asset, file.layer->identifier);
        if (!bytes) return tl::unexpected(bytes.error());
        return pictures_.decode(*bytes);
    });
}

// ---- UsdPreviewSurface ----------------------------------------------------------------------------------------------

Expected<DecodedImage> UsdMaterials::decodePacked(const Input& metal, const Input& roughness) {
    std::vector<PictureChannel> channels;
    for (const auto& [to, from] : {std::pair(1, &roughness), {2, &metal}}) {
        if (!from->texture) continue;
        Expected<DecodedImage> part = decode(*from->texture, Holds::kNumbers);
        if (!part) return part;
        channels.push_back({std::move(*part), usdChannelOf(from->channel), to});
    }
    return joinedChannels(std::move(channels));
}

Expected<void> UsdMaterials::setMetalRoughness(const UsdComposedPrim& shader, const BoundedNumbers& numbers,
                                               UsdLook& look, proto::scene::Material& message) {
    const Expected<Input> metal = input(shader, "metallic"), roughness = input(shader, "roughness");
    if (!metal || !roughness) return tl::unexpected((metal ? roughness : metal).error());
    const auto number = [](const Input& from, double otherwise) {
        return from.value ? from.value->number().value_or(otherwise) : otherwise;
    };
    message.set_metallic(numbers.share("metallic", number(*metal, 0), 0));
    message.set_roughness(numbers.share("roughness", number(*roughness, 0.5), 0.5));
    if (!metal->texture && !roughness->texture) return {};
    const Input& first = metal->texture ? *metal : *roughness;
    const auto wanted = place(*first.texture, look);
    if (!wanted) return tl::unexpected(wanted.error());
    if (!*wanted) return {};
    const auto fileOf = [&](const Input& of) {
        const std::optional<UsdAttribute> file = of.texture ? of.texture->attribute("inputs:file") : std::nullopt;
        return file && file->value && file->value->word() && file->layer
                   ? UsdFiles::identifierOf(*file->value->word(), file->layer->identifier)
                   : std::string();
    };
    const std::string metalFile = fileOf(*metal), roughnessFile = fileOf(*roughness);
    // glTF's way to lay both out is ours, too.
    const bool packed = (!metal->texture || metal->channel == "b") &&
                        (!roughness->texture || roughness->channel == "g") &&
                        (metalFile.empty() || roughnessFile.empty() || metalFile == roughnessFile);
    const std::string image = packed
                                  ? imageOf(fmt::format("texture {}{}", metalFile.empty() ? roughnessFile : metalFile,
                                                        isRecoded(*first.texture, false) ? " made linear" : ""),
                                            **wanted, [&] { return decode(*first.texture, Holds::kNumbers); })
                                  : imageOf(fmt::format("the texture of metal '{}' ({}) and roughness '{}' ({})",
                                                        metalFile, metal->channel, roughnessFile, roughness->channel),
                                            **wanted, [&] { return decodePacked(*metal, *roughness); });
    if (image.empty()) return {};
    message.set_metallic_roughness_image(image);
    const auto factor = [&](const Input& of) { return channelOf(*of.texture, "inputs:scale", of.channel, 1); };
    for (const Input* of : {&*metal, &*roughness})
        if (of->texture && channelOf(*of->texture, "inputs:bias", of->channel, 0) != 0)
            remarks_.add("what is added to textures (bias) is left out", shader.path());
    if (metal->texture) message.set_metallic(numbers.share("metallic", factor(*metal), 1));
    if (roughness->texture) message.set_roughness(numbers.share("roughness", factor(*roughness), 1));
    return {};
}

Expected<void> UsdMaterials::setOpacity(const UsdComposedPrim& shader, const Input& color,
                                        const BoundedNumbers& numbers, UsdLook& look, proto::scene::Material& message) {
    const Expected<Input> opacity = input(shader, "opacity"), threshold = input(shader, "opacityThreshold");
    if (!opacity || !threshold) return tl::unexpected((opacity ? threshold : opacity).error());
    const double share = opacity->value ? opacity->value->number().value_or(1) : 1;
    bool varies = !opacity->primvar.empty();
    if (!opacity->texture) {
        message.mutable_base_color()->set_a(numbers.share("opacity", share, 1));
    } else {
        message.mutable_base_color()->set_a(1);
        const auto fileOf = [](const Input& of) {
            const std::optional<UsdAttribute> file = of.texture ? of.texture->attribute("inputs:file") : std::nullopt;
            return file && file->value && file->value->word() ? *file->value->word() : std::string();
        };
        if (color.texture && opacity->channel == "a" && fileOf(color) == fileOf(*opacity)) {
            varies = true;
        } else {
            // Colours and opacity are one picture here.
            const auto wanted = place(*opacity->texture, look);
            if (!wanted) return tl::unexpected(wanted.error());
            const std::string image =
                *wanted ? imageOf(fmt::format("the texture of colour '{}' and opacity '{}' ({})", fileOf(color),
                                              fileOf(*opacity), opacity->channel),
                                  **wanted,
                                  [&]() -> Expected<DecodedImage> {
                                      std::vector<PictureChannel> channels;
                                      for (int i = 0; color.texture && i < 3; ++i) {
                                          Expected<DecodedImage> part = decode(*color.texture, Holds::kColors);
                                          if (!part) return part;
                                          channels.push_back({std::move(*part), i, i});
                                      }
                                      Expected<DecodedImage> part = decode(*opacity->texture, Holds::kNumbers);
                                      if (!part) return part;
                                      channels.push_back({std::move(*part), usdChannelOf(opacity->channel), 3});
                                      return joinedChannels(std::move(channels));
                                  })
                        : "";
            varies = !image.empty();
            if (varies) message.set_base_color_image(image);
        }
        if (!message.base_color_image().empty())
            message.mutable_base_color()->set_a(numbers.share(
                "the texture's scale", channelOf(*opacity->texture, "inputs:scale", opacity->channel, 1), 1));
        if (channelOf(*opacity->texture, "inputs:bias", opacity->channel, 0) != 0)
            remarks_.add("what is added to textures (bias) is left out", shader.path());
    }
    const double cutoff = threshold->value ? threshold->value->number().value_or(0) : 0;
    if (cutoff > 0) {
        message.set_alpha_mode(proto::scene::Material::MASK);
        message.set_alpha_cutoff(numbers.share("opacityThreshold", cutoff, 0.5));
    } else {
        message.set_alpha_mode(varies || message.base_color().a() < 1 ? proto::scene::Material::BLEND
                                                                      : proto::scene::Material::OPAQUE);
    }
    return {};
}

Expected<void> UsdMaterials::setSurface(const UsdComposedPrim& shader, UsdLook& look, proto::scene::Material& message) {
    const BoundedNumbers numbers(scene_, shader.path());
    const auto color = [&](const Input& from, std::array<double, 3> otherwise, double most, const char* name,
                           proto::scene::Color& to) {
        const std::vector<double> said = from.value ? from.value->numbers<double>() : std::vector<double>();
        for (std::size_t i = 0; i < 3 && said.size() >= 3; ++i) otherwise[i] = said[i];
        to.set_r(numbers.between(0, most, name, otherwise[0], 0));
        to.set_g(numbers.between(0, most, name, otherwise[1], 0));
        to.set_b(numbers.between(0, most, name, otherwise[2], 0));
    };
    const auto factors = [&](const Texture& texture, double most, const char* name, proto::scene::Color& to) {
        to.set_r(numbers.between(0, most, name, texture.scale[0], 1));
        to.set_g(numbers.between(0, most, name, texture.scale[1], 1));
        to.set_b(numbers.between(0, most, name, texture.scale[2], 1));
        if (std::ranges::any_of(std::span(texture.bias).first(3), [](double part) { return part != 0; }))
            remarks_.add("what is added to textures (bias) is left out", shader.path());
    };
    const Expected<Input> diffuse = input(shader, "diffuseColor");
    if (!diffuse) return tl::unexpected(diffuse.error());
    color(*diffuse, {0.18, 0.18, 0.18}, 1, "diffuseColor", *message.mutable_base_color());
    if (diffuse->texture) {
        const Expected<Texture> made = texture(*diffuse, look, Holds::kColors);
        if (!made) return tl::unexpected(made.error());
        message.set_base_color_image(made->image);
        if (diffuse->channel != "rgb")
            remarks_.add("colours of one channel of a texture have all its channels", shader.path());
        if (!made->image.empty()) factors(*made, 1, "the texture's scale", *message.mutable_base_color());
    } else if (!diffuse->primvar.empty()) {
        look.colors = diffuse->primvar;
        factors({}, 1, "", *message.mutable_base_color());
    }
    if (Expected<void> done = setOpacity(shader, *diffuse, numbers, look, message); !done) return done;
    if (Expected<void> done = setMetalRoughness(shader, numbers, look, message); !done) return done;

    const Expected<Input> emissive = input(shader, "emissiveColor");
    if (!emissive) return tl::unexpected(emissive.error());
    color(*emissive, {0, 0, 0}, 1e9, "emissiveColor", *message.mutable_emissive());
    if (emissive->texture) {
        const Expected<Texture> made = texture(*emissive, look, Holds::kColors);
        if (!made) return tl::unexpected(made.error());
        message.set_emissive_image(made->image);
        if (!made->image.empty()) factors(*made, 1e9, "the texture's scale", *message.mutable_emissive());
    }
    const Expected<Input> normal = input(shader, "normal");
    if (!normal) return tl::unexpected(normal.error());
    if (normal->texture) {
        const Expected<Texture> made = texture(*normal, look, Holds::kNumbers);
        if (!made) return tl::unexpected(made.error());
        message.set_normal_image(made->image);
        // Of pictures of 8 bits the scale is 2, which makes -1 to 1 of them; more of it are higher bumps.
        if (made->scale[0] * made->scale[1] < 0)
            remarks_.add("normals whose green is turned around are shown as if it were not", shader.path());
        if (!made->image.empty() && made->scale[0] != 1)
            message.set_normal_scale(numbers.between(-1e3, 1e3, "the scale of normals", made->scale[0] / 2, 1));
    }
    const Expected<Input> occlusion = input(shader, "occlusion");
    if (!occlusion) return tl::unexpected(occlusion.error());
    if (occlusion->texture) {
        if (usdChannelOf(occlusion->channel) == 0) {
            const Expected<Texture> made = texture(*occlusion, look, Holds::kNumbers);
            if (!made) return tl::unexpected(made.error());
            message.set_occlusion_image(made->image);
        } else {
            remarks_.add("occlusion in another channel than red is left out", shader.path());
        }
    }
    const auto number = [&](const char* name, double otherwise) -> Expected<double> {
        const Expected<Input> said = input(shader, name);
        if (!said) return tl::unexpected(said.error());
        if (said->texture) remarks_.add(fmt::format("textures of {} are left out", name), shader.path());
        return said->value ? said->value->number().value_or(otherwise) : otherwise;
    };
    const Expected<double> coat = number("clearcoat", 0), coatRoughness = number("clearcoatRoughness", 0.01),
                           ior = number("ior", 1.5), specularWay = number("useSpecularWorkflow", 0),
                           displacement = number("displacement", 0);
    for (const Expected<double>* each : {&coat, &coatRoughness, &ior, &specularWay, &displacement})
        if (!*each) return tl::unexpected(each->error());
    message.set_clearcoat(numbers.share("clearcoat", *coat, 0));
    if (*coat > 0) message.set_clearcoat_roughness(numbers.share("clearcoatRoughness", *coatRoughness, 0.01));
    message.set_ior(numbers.between(1, 100, "ior", *ior, 1.5));
    if (*displacement != 0) remarks_.add("displacements are left out", shader.path());
    if (*specularWay != 0) {
        // Reflections straight on have this colour, whatever the index of refraction is.
        const Expected<Input> specular = input(shader, "specularColor");
        if (!specular) return tl::unexpected(specular.error());
        proto::scene::Color straight;
        color(*specular, {0, 0, 0}, 1, "specularColor", straight);
        const double root = (message.ior() - 1) / (message.ior() + 1), most = root * root;
        const auto tint = [&](double part) { return static_cast<float>(most > 0 ? std::min(part / most, 1e3) : 0); };
        message.set_metallic(0);
        message.mutable_specular_color()->set_r(tint(straight.r()));
        message.mutable_specular_color()->set_g(tint(straight.g()));
        message.mutable_specular_color()->set_b(tint(straight.b()));
        if (specular->texture) remarks_.add("textures of specularColor are left out", shader.path());
    }
    return {};
}

}  // namespace tessera
