#include "client/draw/DrawCalls.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// What glTF allows; below, highlights would be smaller than a pixel and a point light's a flicker.
constexpr float kSmallestRoughness = 0.045f;

std::array<float, 4> four(const Vec3f& v, float w) {
    return {v.x(), v.y(), v.z(), w};
}

std::array<float, 16> columnsOf(const Mat4d& m) {
    std::array<float, 16> columns{};
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) columns[static_cast<std::size_t>(4 * c + r)] = static_cast<float>(m(r, c));
    return columns;
}

/// Depth runs from 1 at the near plane to 0 at the far one: as a float it then resolves about the same relative
/// distance everywhere.
Mat4d reversedDepth(const Mat4d& clip_T_eye) {
    Mat4d m = clip_T_eye;
    m.row(2) = 0.5 * (clip_T_eye.row(3) - clip_T_eye.row(2));
    return m;
}

/// KHR_texture_transform: moved · turned · scaled.
LookBlock::Placed placeOf(const Image& image) {
    const float c = std::cos(image.rotation), s = std::sin(image.rotation);
    const auto set = static_cast<float>(image.texcoordSet);
    return {.u = {c * image.scale.x(), s * image.scale.y(), image.offset.x(), set},
            .v = {-s * image.scale.x(), c * image.scale.y(), image.offset.y(), 0}};
}

}  // namespace

std::array<std::pair<ObjectId, ImageUse>, kImageMaps> imagesOf(const Material& material) {
    return {{{material.baseColorImage, ImageUse::kColor},
             {material.metallicRoughnessImage, ImageUse::kNumbers},
             {material.normalImage, ImageUse::kNumbers},
             {material.occlusionImage, ImageUse::kNumbers},
             {material.emissiveImage, ImageUse::kColor}}};
}

bool DrawCalls::TexelsLess::operator()(const MaterialTexels& a, const MaterialTexels& b) const {
    return std::tie(a.emissiveAndRoughness, a.metallicLitAndCoat) <
           std::tie(b.emissiveAndRoughness, b.metallicLitAndCoat);
}

void DrawCalls::collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera, MeshBuffers& meshes,
                        TextureCache& textures) {
    calls_.clear();
    records_.clear();
    blocks_.clear();
    sortedIndices_.clear();
    parts_.clear();
    materials_.clear();
    materialIndices_.clear();
    widestLineReachPx_ = 0;
    looks_.clear();
    lookBlocks_.clear();
    for (auto& indices : lookIndices_) indices.clear();
    counts_ = {.items = list.opaque.size()};
    materials_.push_back({.emissiveAndRoughness = four(list.environment.background, 1), .metallicLitAndCoat = {}});
    meshes.beginDraw();
    textures.beginDraw();
    for (const DrawItem& item : list.opaque) collect(aspect, item, camera, meshes, textures);
    opaqueCount_ = calls_.size();
    for (const DrawItem& item : list.transparent) {
        if (item.sortedCount == 0) {
            ++counts_.items;
            collect(aspect, item, camera, meshes, textures);
            continue;
        }
        const auto [seen, isNew] = parts_.try_emplace(item.node);
        counts_.items += isNew;
        if (isNew && collect(aspect, item, camera, meshes, textures)) {
            seen->second = {calls_.back(), drawableOf(aspect, item.geometry).at(item.fineness).arrays().indices, true};
            calls_.pop_back();
        }
        if (!seen->second.there) continue;
        calls_.push_back(seen->second.call);
        DrawCall& call = calls_.back();
        call.item = &item;
        call.firstSorted = static_cast<std::uint32_t>(sortedIndices_.size());
        call.sortedCount = 3 * item.sortedCount;
        const std::span<const std::uint32_t> indices = seen->second.indices.as<std::uint32_t>();
        for (const std::uint32_t t : std::span(list.sortedTriangles).subspan(item.sortedFrom, item.sortedCount)) {
            const std::array<std::uint32_t, 3> corners = cornersOf(item.kind, indices, t);
            sortedIndices_.insert(sortedIndices_.end(), corners.begin(), corners.end());
        }
    }
}

bool DrawCalls::collect(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera, MeshBuffers& meshes,
                        TextureCache& textures) {
    const Drawable drawable = drawableOf(aspect, item.geometry).at(item.fineness);
    const std::optional<MeshRange> mesh = drawable ? meshes.find(drawable) : std::nullopt;
    const bool fits = mesh && mesh->kind == item.kind;
    if (!fits) ++counts_.skipped;
    if (!fits || mesh->indexCount == 0) return false;
    const std::uint32_t index = look(aspect, item.material, rowOf(item.kind).surface, textures);
    const DrawLook& look = looks_[index];
    if (look.incomplete) ++counts_.untextured;
    widestLineReachPx_ = std::max(widestLineReachPx_, lineReachPx(item.lineWidth));
    calls_.push_back({.mesh = *mesh,
                      .record = static_cast<std::uint32_t>(records_.size()),
                      .block = static_cast<std::uint32_t>(blocks_.size()),
                      .look = index,
                      .mirrored = item.mirrored,
                      .item = &item});
    records_.push_back(tessera::recordOf(item, camera));
    if (isLarge(calls_.back())) blocks_.push_back({records_.back()});
    return true;
}

std::uint32_t DrawCalls::look(const Aspect& aspect, ObjectId id, bool surface, TextureCache& textures) {
    const auto [known, isNew] = lookIndices_[surface].try_emplace(id, static_cast<std::uint32_t>(looks_.size()));
    if (!isNew) return known->second;
    static const Material kDefault;
    const auto* own = id ? aspect.get<Material>(id) : nullptr;
    const Material& material = own ? *own : kDefault;
    DrawLook look{.masked = material.alphaMode == Material::kMask, .doubleSided = material.doubleSided || !surface};
    LookBlock block{};
    block.baseColor = {material.baseColor.x(), material.baseColor.y(), material.baseColor.z(), material.baseColor.w()};
    block.emissiveAndRoughness = four(material.emissive, std::clamp(material.roughness, kSmallestRoughness, 1.0f));
    block.metallic[0] = material.metallic;
    block.material[0] = materialIndex(material, material.unlit || !surface);
    const auto packed = packedMaterial(block.material[0], block.baseColor);
    block.material[1] = packed[0];
    block.material[2] = packed[1];
    const auto images = imagesOf(material);
    for (std::size_t i = 0; i < kImageMaps; ++i) {
        const auto& [imageId, use] = images[i];
        // Without a surface there is a base colour alone.
        if (!imageId || (!surface && i > 0)) continue;
        const auto* image = aspect.get<Image>(imageId);
        const GLuint texture = image ? textures.find(*image, use) : 0;
        if (texture == 0) {
            look.incomplete = true;
            continue;
        }
        look.maps[i] = {texture, textures.sampler(*image)};
        look.mapBits |= bitOf(static_cast<ImageMap>(i));
        block.places[i] = placeOf(*image);
    }
    block.strengths = {material.normalScale, material.occlusionStrength, material.alphaCutoff, 0};
    block.effects = {material.transmission, material.unlit || !surface ? 1.0f : 0.0f, material.clearcoat, material.clearcoatRoughness};
    looks_.push_back(look);
    lookBlocks_.push_back(block);
    return known->second;
}

std::uint32_t DrawCalls::materialIndex(const Material& material, bool unlit) {
    const MaterialTexels texels{
        .emissiveAndRoughness = four(material.emissive, std::clamp(material.roughness, kSmallestRoughness, 1.0f)),
        .metallicLitAndCoat = {material.metallic, unlit ? -1.0f : 1.0f, material.clearcoat,
                               material.clearcoatRoughness}};
    const auto [it, isNew] = materialIndices_.try_emplace(texels, static_cast<std::uint32_t>(materials_.size()));
    if (!isNew) return it->second;
    if (materials_.size() == kMaxMaterials) {
        // Sixteen thousand kinds of gloss in one picture: the last one stands for those beyond.
        it->second = kMaxMaterials - 1;
        return it->second;
    }
    materials_.push_back(texels);
    return it->second;
}

ItemRecord recordOf(const DrawItem& item, const ScreenCamera& camera) {
    const Affine3d eye_T_item = camera.eye_T_world * item.world_T_item;
    const Mat3d m = eye_T_item.linear();
    // The matrix of cofactors is the inverse transpose times the determinant, and exists where the inverse does not.
    Mat3d cofactors;
    cofactors.row(0) = m.row(1).cross(m.row(2));
    cofactors.row(1) = m.row(2).cross(m.row(0));
    cofactors.row(2) = m.row(0).cross(m.row(1));
    const double largest = cofactors.cwiseAbs().maxCoeff();
    if (largest > 0) cofactors /= m.determinant() < 0 ? -largest : largest;

    ItemRecord record{};
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) {
            const auto row = static_cast<std::size_t>(r), column = static_cast<std::size_t>(c);
            record.eye_T_item[row][column] = static_cast<float>(eye_T_item(r, c));
            if (c < 3) record.normalRows[row][column] = static_cast<float>(cofactors(r, c));
        }
    record.size = formOf(item.kind).size(item, m);
    record.node = {static_cast<std::uint32_t>(item.node.value), static_cast<std::uint32_t>(item.node.value >> 32)};
    return record;
}

FrameBlock makeFrameBlock(const DrawList& list, const ScreenCamera& camera) {
    // Metres per world unit: a wall may stand in a world of any scale.
    const double scale = std::cbrt(std::abs(camera.eye_T_world.linear().determinant()));
    const Mat3d eye_R_world = camera.eye_T_world.linear() / (scale > 0 ? scale : 1.0);
    const Mat3d world_R_eye =
        Eigen::AngleAxisd(list.environment.image ? -list.environment.turn : 0.0, Vec3d::UnitY()).toRotationMatrix() *
        eye_R_world.transpose();
    const Mat4d clip_T_eye = reversedDepth(camera.clip_T_eye);
    FrameBlock block{};
    block.clip_T_eye = columnsOf(clip_T_eye);
    block.eye_T_clip = columnsOf(clip_T_eye.inverse());
    for (int i = 0; i < 3; ++i) {
        const Vec3d row = world_R_eye.row(i);
        block.world_R_eye[static_cast<std::size_t>(i)] = four(row.cast<float>(), 0);
    }
    block.sky = four(list.environment.sky, 0);
    block.ground = four(list.environment.ground, 0);
    block.clipPerPixel = {2.0f / static_cast<float>(camera.pixels.width),
                          2.0f / static_cast<float>(camera.pixels.height), 0, 0};
    const Vec3d head = camera.eye_T_world * camera.headWorld;
    block.head = four(head.cast<float>(), 0);
    return block;
}

}  // namespace tessera
