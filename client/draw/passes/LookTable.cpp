#include "client/draw/passes/LookTable.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/cores/SurfaceParts.h"

namespace tessera {
namespace {

/// What glTF allows; below, highlights would be smaller than a pixel and a point light's a flicker.
constexpr float kSmallestRoughness = 0.045f;
/// In GL's buffers at first.
constexpr std::size_t kFirstElements = 64;

bool saysNoColor(const Material& material) {
    static const Material kSaysNothing;
    return material.baseColor == kSaysNothing.baseColor && material.metallic == kSaysNothing.metallic &&
           material.roughness == kSaysNothing.roughness && material.emissive == kSaysNothing.emissive &&
           material.shading == kSaysNothing.shading && !material.baseColorImage && !material.metallicRoughnessImage &&
           !material.program && material.layers.empty() && !material.unlit;
}

std::array<float, 4> vec4Of(const Vec3f& v, float w) {
    return {v.x(), v.y(), v.z(), w};
}

/// KHR_texture_transform: moved · turned · scaled.
LookBlock::Placed placeOf(const Image& image) {
    const float c = std::cos(image.rotation), s = std::sin(image.rotation);
    const auto set = static_cast<float>(image.texcoordSet);
    return {.u = {c * image.scale.x(), s * image.scale.y(), image.offset.x(), set},
            .v = {-s * image.scale.x(), c * image.scale.y(), image.offset.y(), 0}};
}

/// Fresnel's reflection straight on of what is no metal, tinted (KHR_materials_ior, KHR_materials_specular); w at a
/// glancing angle.
std::array<float, 4> specularOf(const Material& material) {
    if (material.shading == Material::kPhong) return vec4Of(material.specular * material.specularColor, 0);
    const float root = (material.ior - 1) / (material.ior + 1);
    return vec4Of(material.specular * (root * root * material.specularColor).cwiseMin(1.0f), material.specular);
}

MaterialTexels texelsOf(const Material& material, bool unlit, std::uint32_t scopes) {
    const bool phong = material.shading == Material::kPhong;
    return {.emissiveAndRoughness = vec4Of(material.emissive, std::clamp(material.roughness, kSmallestRoughness, 1.0f)),
            .metallicLitAndCoat = {phong ? 0 : material.metallic, unlit ? -1.0f : 1.0f, material.clearcoat,
                                   material.clearcoatRoughness},
            .specular = specularOf(material),
            .shininessAndScopes = {phong ? material.shininess : -1.0f, 0, static_cast<float>(scopes & 0xffffu),
                                   static_cast<float>(scopes >> 16u)}};
}

}  // namespace

std::array<std::pair<ObjectId, ImageUse>, kImageMaps> imagesOf(const Material& material) {
    return {{{material.baseColorImage, ImageUse::kColor},
             {material.metallicRoughnessImage, ImageUse::kNumbers},
             {material.normalImage, ImageUse::kNumbers},
             {material.occlusionImage, ImageUse::kNumbers},
             {material.emissiveImage, ImageUse::kColor}}};
}

const Image* normalMapOf(const LookSource* source) {
    const Image* image = source ? source->normalImage.get() : nullptr;
    return image && textureTarget(*image) == GL_TEXTURE_2D ? image : nullptr;
}

const Image* normalMapOf(const Aspect& aspect, ObjectId id) {
    const auto* material = id ? aspect.get<Material>(id) : nullptr;
    const auto* image = material && material->normalImage ? aspect.get<Image>(material->normalImage) : nullptr;
    return image && textureTarget(*image) == GL_TEXTURE_2D ? image : nullptr;
}

LookTable::LookTable(GlState& gl) : gl_(gl) {
    for (GLuint* buffer : {&lookBuffer_.name, &materialBuffer_.name}) gl_.CreateBuffers(1, buffer);
    gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &materialTexture_);
    static_cast<void>(place(materialBuffer_, freeMaterials_, materialsUsed_));  // the background's
    materialUsers_.push_back(1);
}

LookTable::~LookTable() {
    for (const GLuint* buffer : {&lookBuffer_.name, &materialBuffer_.name}) gl_.DeleteBuffers(1, buffer);
    gl_.DeleteTextures(1, &materialTexture_);
}

void LookTable::beginDraw() {
    ++draw_;
    if (indices_.size() > sweepAt_) {
        forgetBefore(draw_ - std::min(draw_, kDrawsKept));
        sweepAt_ = std::max(kLooksKept, 2 * indices_.size());
    }
}

void LookTable::setBackground(const Vec3f& radiance) {
    const MaterialTexels texels{.emissiveAndRoughness = vec4Of(radiance, 1), .metallicLitAndCoat = {}};
    if (materialBuffer_.elements[0] == texels) return;
    materialBuffer_.elements[0] = texels;
    materialBuffer_.stale.push_back(0);
}

std::uint32_t LookTable::find(const Aspect& aspect, const LookSource* source, std::uint32_t scopes, Of of,
                              TextureCache& textures) {
    const Key key{.serial = source ? source->serial : 0, .scopes = scopes, .of = of};
    // Neighbours in a list are of one material.
    if (last_ < entries_.size() && entries_[last_].draw == draw_ && entries_[last_].key == key) return last_;
    const auto known = indices_.find(key);
    if (known != indices_.end()) {
        last_ = known->second;
        Entry& entry = entries_[last_];
        if (entry.draw == draw_) return last_;
        entry.draw = draw_;
        if (!isFresh(entry, source, textures)) make(aspect, source, last_, textures);
        return last_;
    }
    const std::uint32_t index = place(lookBuffer_, free_, looksUsed_);
    if (index >= entries_.size()) entries_.resize(std::size_t{index} + 1);
    entries_[index] = {.key = key, .draw = draw_, .held = true};
    indices_.emplace(key, index);
    make(aspect, source, index, textures);
    return index;
}

bool LookTable::isFresh(Entry& entry, const LookSource* source, TextureCache& textures) {
    if (entry.version != (source ? source->version : 0)) return false;
    if (entry.asksPersons && entry.persons != persons_.changes()) return false;
    persons_.use(entry.known);
    const auto there = [&textures](const auto& map) { return !map.texture || textures.use(*map.texture); };
    return std::ranges::all_of(entry.look.maps, there) && std::ranges::all_of(entry.look.layers, there) &&
           std::ranges::all_of(entry.look.said.maps, there);
}

void LookTable::make(const Aspect& aspect, const LookSource* source, std::uint32_t index, TextureCache& textures) {
    static const Material kDefault, kError{.baseColor = {1, 0, 1, 1}, .doubleSided = true, .unlit = true};
    Entry& entry = entries_[index];
    const std::uint32_t scopes = entry.key.scopes;
    const bool surface = entry.key.of != Of::kNoSurface;
    const auto* own = source && source->material ? aspect.get<Material>(source->material) : nullptr;
    const Material& material = own && hasBadProgram(aspect, *own) ? kError : own ? *own : kDefault;
    DrawLook look{.masked = material.alphaMode == Material::kMask, .doubleSided = material.doubleSided || !surface};
    LookBlock block{};
    block.baseColor = {material.baseColor.x(), material.baseColor.y(), material.baseColor.z(), material.baseColor.w()};
    // Formats without materials give one that says nothing.
    if (entry.key.of == Of::kStudioSurface && saysNoColor(material)) block.baseColor = {0.42f, 0.42f, 0.42f, 1};
    const MaterialTexels texels = texelsOf(material, material.unlit || !surface, scopes);
    block.emissiveAndRoughness = texels.emissiveAndRoughness;
    block.metallic = {texels.metallicLitAndCoat[0], texels.shininessAndScopes[0], 0, 0};
    block.specular = texels.specular;
    const std::uint32_t materialBefore = entry.material;
    entry.material = block.material[0] = takeMaterial(texels);
    leaveMaterial(materialBefore);
    block.material[3] = scopes;
    const auto packed = packedMaterial(block.material[0], block.baseColor);
    block.material[1] = packed[0];
    block.material[2] = packed[1];
    const auto images = imagesOf(material);
    for (std::size_t i = 0; i < kImageMaps; ++i) {
        const auto& [imageId, use] = images[i];
        // Without a surface there is a base colour alone.
        if (!imageId || (!surface && i > 0)) continue;
        // Phong's has neither metal nor roughness.
        if (material.shading == Material::kPhong && static_cast<ImageMap>(i) == ImageMap::kMetallicRoughness) continue;
        const auto* image = aspect.get<Image>(imageId);
        // Cubes and solids are for layers.
        TextureCache::Found texture;
        if (image && textureTarget(*image) == GL_TEXTURE_2D) texture = textures.find(*image, use);
        if (!texture) {
            look.incomplete = true;
            continue;
        }
        look.maps[i] = {std::move(texture), TextureCache::samplerOf(*image)};
        look.mapBits |= bitOf(static_cast<ImageMap>(i));
        block.places[i] = placeOf(*image);
    }
    block.strengths = {material.normalScale, material.occlusionStrength, material.alphaCutoff, 0};
    block.effects = {material.transmission, material.unlit || !surface ? 1.0f : 0.0f, material.clearcoat,
                     material.clearcoatRoughness};
    if (surface) addLayers(aspect, material, textures, look, block);
    PersonPrograms::Found person;
    if (own && surface) {
        person = persons_.find(aspect, *own);
        look.person = person.drawn;
        look.said = persons_.valuesOf(aspect, *own, look.person, textures);
    }
    entry.look = std::move(look);
    entry.version = source ? source->version : 0;
    entry.persons = persons_.changes();
    entry.known = person.known;
    entry.asksPersons = own && own->program;
    if (std::memcmp(&lookBuffer_.elements[index], &block, sizeof block) == 0) return;
    lookBuffer_.elements[index] = block;
    lookBuffer_.stale.push_back(index);
}

/// One without an image is nothing, and takes no place.
void LookTable::addLayers(const Aspect& aspect, const Material& material, TextureCache& textures, DrawLook& look,
                          LookBlock& block) {
    std::size_t count = 0;
    for (const ObjectId id : material.layers) {
        const auto* layer = aspect.get<TextureLayer>(id);
        if (count == Material::kMostLayers || !layer || !layer->image) continue;
        const auto* image = aspect.get<Image>(layer->image);
        const LayerLookup lookup = image ? lookupOf(layer->source, image->shape) : LayerLookup::kNone;
        TextureCache::Found texture;
        if (lookup != LayerLookup::kNone) texture = textures.find(*image, ImageUse::kColor);
        if (!texture) {
            look.incomplete = true;
            continue;
        }
        look.layers[count] = {std::move(texture), TextureCache::samplerOf(*image)};
        look.layerBits =
            static_cast<std::uint16_t>(look.layerBits | static_cast<unsigned>(lookup) << (kLayerBits * count));
        block.layerPlaces[count] = placeOf(*image);
        block.layers[count] = {static_cast<float>(layer->mode), layer->strength, 0, 0};
        ++count;
    }
}

void LookTable::forgetBefore(std::uint64_t draw) {
    for (std::uint32_t index = 0; index < entries_.size(); ++index) {
        Entry& entry = entries_[index];
        if (!entry.held || entry.draw >= draw) continue;
        leaveMaterial(entry.material);
        indices_.erase(entry.key);
        entry = {};
        free_.push_back(index);
    }
}

std::uint32_t LookTable::takeMaterial(const MaterialTexels& texels) {
    const auto count = [this](std::uint32_t index) {
        ++materialUsers_[index];
        return index;
    };
    if (const auto known = materialIndices_.find(texels); known != materialIndices_.end()) return count(known->second);
    // Sixteen thousand kinds of gloss: what this draw does not show makes room; in one picture the last one stands for
    // those beyond.
    if (freeMaterials_.empty() && materialsUsed_ == kMaxMaterials) forgetBefore(draw_);
    if (freeMaterials_.empty() && materialsUsed_ == kMaxMaterials) return count(kMaxMaterials - 1);
    const std::uint32_t index = place(materialBuffer_, freeMaterials_, materialsUsed_);
    if (index >= materialUsers_.size()) materialUsers_.resize(std::size_t{index} + 1);
    materialBuffer_.elements[index] = texels;
    materialBuffer_.stale.push_back(index);
    materialIndices_.emplace(texels, index);
    return count(index);
}

void LookTable::leaveMaterial(std::uint32_t index) {
    if (index == 0 || --materialUsers_[index] > 0) return;
    materialIndices_.erase(materialBuffer_.elements[index]);
    freeMaterials_.push_back(index);
}

template <typename T>
std::uint32_t LookTable::place(Mirror<T>& in, std::vector<std::uint32_t>& free, std::uint32_t& used) {
    if (!free.empty()) {
        const std::uint32_t index = free.back();
        free.pop_back();
        return index;
    }
    if (used == in.elements.size()) {
        in.elements.resize(std::max(kFirstElements, 2 * in.elements.size()));
        in.grown = true;
    }
    return used++;
}

/// Neighbours go together.
template <typename T>
std::uint64_t LookTable::bring(Mirror<T>& mirror) {
    std::ranges::sort(mirror.stale);
    mirror.stale.erase(std::unique(mirror.stale.begin(), mirror.stale.end()), mirror.stale.end());
    const std::uint64_t count = mirror.stale.size();
    if (std::exchange(mirror.grown, false)) {
        gl_.NamedBufferData(mirror.name, static_cast<GLsizeiptr>(mirror.elements.size() * sizeof(T)),
                            mirror.elements.data(), GL_DYNAMIC_DRAW);
        mirror.stale.clear();
    }
    for (std::size_t i = 0, next = 0; i < mirror.stale.size(); i = next) {
        for (next = i + 1; next < mirror.stale.size() && mirror.stale[next] == mirror.stale[next - 1] + 1;) ++next;
        gl_.NamedBufferSubData(mirror.name, static_cast<GLintptr>(mirror.stale[i] * sizeof(T)),
                               static_cast<GLsizeiptr>((next - i) * sizeof(T)), &mirror.elements[mirror.stale[i]]);
    }
    mirror.stale.clear();
    return count;
}

std::uint64_t LookTable::upload() {
    if (std::exchange(materialBuffer_.grown, false)) {
        gl_.fill(materialTexture_, GL_RGBA32F, materialBuffer_.name,
                 std::as_bytes(std::span(materialBuffer_.elements)));
        materialBuffer_.stale.clear();
    }
    static_cast<void>(bring(materialBuffer_));
    return bring(lookBuffer_);
}

}  // namespace tessera
