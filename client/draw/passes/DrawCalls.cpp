#include "client/draw/passes/DrawCalls.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/cores/SurfaceParts.h"
#include "common/math/Decompositions.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

/// What glTF allows; below, highlights would be smaller than a pixel and a point light's a flicker.
constexpr float kSmallestRoughness = 0.045f;

bool saysNoColor(const Material& material) {
    static const Material kSaysNothing;
    return material.baseColor == kSaysNothing.baseColor && material.metallic == kSaysNothing.metallic &&
           material.roughness == kSaysNothing.roughness && material.emissive == kSaysNothing.emissive &&
           material.shading == kSaysNothing.shading && !material.baseColorImage && !material.metallicRoughnessImage &&
           !material.program && material.layers.empty() && !material.unlit;
}

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

/// Fresnel's reflection straight on of what is no metal, tinted (KHR_materials_ior, KHR_materials_specular); w at a
/// glancing angle.
std::array<float, 4> specularOf(const Material& material) {
    if (material.shading == Material::kPhong) return four(material.specular * material.specularColor, 0);
    const float root = (material.ior - 1) / (material.ior + 1);
    return four(material.specular * (root * root * material.specularColor).cwiseMin(1.0f), material.specular);
}

MaterialTexels texelsOf(const Material& material, bool unlit, std::uint32_t scopes) {
    const bool phong = material.shading == Material::kPhong;
    return {.emissiveAndRoughness = four(material.emissive, std::clamp(material.roughness, kSmallestRoughness, 1.0f)),
            .metallicLitAndCoat = {phong ? 0 : material.metallic, unlit ? -1.0f : 1.0f, material.clearcoat,
                                   material.clearcoatRoughness},
            .specular = specularOf(material),
            .shininessAndScopes = {phong ? material.shininess : -1.0f, 0, static_cast<float>(scopes & 0xffffu),
                                   static_cast<float>(scopes >> 16u)}};
}

std::vector<ObjectId> passIds(const Aspect& aspect, ObjectId id) {
    std::vector<ObjectId> ids;
    const auto* material = id ? aspect.get<Material>(id) : nullptr;
    if (!material || material->passes.empty() || PersonPrograms::isBad(aspect, *material)) return ids;
    for (const ObjectId pass : material->passes)
        if (ids.size() < Material::kMostPasses && aspect.get<Material>(pass)) ids.push_back(pass);
    return ids;
}

}  // namespace

std::array<std::pair<ObjectId, ImageUse>, kImageMaps> imagesOf(const Material& material) {
    return {{{material.baseColorImage, ImageUse::kColor},
             {material.metallicRoughnessImage, ImageUse::kNumbers},
             {material.normalImage, ImageUse::kNumbers},
             {material.occlusionImage, ImageUse::kNumbers},
             {material.emissiveImage, ImageUse::kColor}}};
}

void DrawCalls::collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera, MeshBuffers& meshes,
                        TextureCache& textures, VolumeTextures& volumes) {
    calls_.clear();
    passItems_.clear();
    records_.clear();
    blocks_.clear();
    volumes_.clear();
    sortedIndices_.clear();
    parts_.clear();
    materials_.clear();
    materialIndices_.clear();
    widestLineReachPx_ = 0;
    looks_.clear();
    lookBlocks_.clear();
    for (auto& indices : lookIndices_) indices.clear();
    scoped_ = std::ranges::any_of(list.lights, [](const LightItem& light) { return light.scope != 0; });
    inStudio_ = list.studio.has_value();
    counts_ = {.items = list.opaque.size()};
    materials_.push_back({.emissiveAndRoughness = four(list.environment.background, 1), .metallicLitAndCoat = {}});
    meshes.beginDraw();
    textures.beginDraw();
    volumes.beginDraw();
    for (const DrawItem& listed : list.opaque) {
        const DrawItem& item = shownOf(aspect, listed, camera);
        // Of what is at one depth the first is seen: the last pass comes first, the material itself last.
        const std::vector<ObjectId> passes = passIds(aspect, item.material);
        for (auto pass = passes.rbegin(); pass != passes.rend(); ++pass)
            if (!isBlended(*aspect.get<Material>(*pass)))
                collect(aspect, passOf(aspect, item, *pass), camera, meshes, textures, volumes);
        collect(aspect, item, camera, meshes, textures, volumes);
    }
    opaqueCount_ = calls_.size();
    for (const DrawItem& listed : list.transparent) {
        const DrawItem& item = shownOf(aspect, listed, camera);
        const std::vector<ObjectId> passes = passIds(aspect, item.material);
        if (item.sortedCount == 0) {
            counts_.items += !item.over;
            if (!item.over) collect(aspect, item, camera, meshes, textures, volumes);
            for (const ObjectId pass : passes)
                if ((!item.over || isBlended(*aspect.get<Material>(pass))) &&
                    collect(aspect, passOf(aspect, item, pass), camera, meshes, textures, volumes))
                    calls_.back().equal = item.over;
            continue;
        }
        const auto [seen, isNew] = parts_.try_emplace(item.node);
        counts_.items += isNew;
        if (isNew && collect(aspect, item, camera, meshes, textures, volumes)) {
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
        // Over each part in its turn; outlines over the whole of it, behind its first part.
        const DrawCall part = calls_.back();
        for (const ObjectId pass : passes) {
            if (aspect.get<Material>(pass)->fill != Material::kFilled && rowOf(item.kind).ownTriangles) {
                if (isNew) collect(aspect, passOf(aspect, item, pass), camera, meshes, textures, volumes);
                continue;
            }
            DrawCall& over = calls_.emplace_back(part);
            over.look = look(aspect, pass, scoped_ ? item.scopes : 0, LookOf::kSurface, textures);
        }
    }
}

bool DrawCalls::collect(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera, MeshBuffers& meshes,
                        TextureCache& textures, VolumeTextures& volumes) {
    if (step_) step_();
    const Drawable drawable = drawableOf(aspect, item.geometry).at(item.fineness);
    const std::optional<MeshRange> mesh = !drawable                        ? std::nullopt
                                          : item.fill == Material::kFilled ? meshes.find(drawable)
                                                                           : meshes.findOutline(drawable, item.fill);
    const bool fits = mesh && mesh->kind == item.kind;
    if (!fits) ++counts_.skipped;
    if (!fits || mesh->indexCount == 0) return false;
    const std::uint32_t index = look(aspect, item.material, scoped_ ? item.scopes : 0,
                                     !rowOf(item.kind).surface       ? LookOf::kNoSurface
                                     : inStudio_ && !mesh->hasColors ? LookOf::kStudioSurface
                                                                     : LookOf::kSurface,
                                     textures);
    const DrawLook& look = looks_[index];
    if (look.incomplete) ++counts_.untextured;
    widestLineReachPx_ = std::max(widestLineReachPx_, lineReachPx(item.lineWidth));
    DrawCall call{.mesh = *mesh,
                  .record = static_cast<std::uint32_t>(records_.size()),
                  .block = static_cast<std::uint32_t>(blocks_.size()),
                  .look = index,
                  .mirrored = item.mirrored,
                  .item = &item};
    if (rowOf(item.kind).volume && !addVolume(aspect, item, camera, volumes, call)) {
        ++counts_.skipped;
        return false;
    }
    if (item.kind == DrawKind::kPoints && isStretched(item.world_T_item.linear()))
        call.mesh.pointParts |= kPointStretched;
    calls_.push_back(call);
    records_.push_back(tessera::recordOf(item, camera));
    if (isLarge(calls_.back())) blocks_.push_back({records_.back()});
    return true;
}

bool DrawCalls::addVolume(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera,
                          VolumeTextures& volumes, DrawCall& call) {
    const auto* volume = aspect.get<Volume>(item.geometry);
    if (volume) call.voxels = volumes.find(*volume);
    if (call.voxels.voxels == 0) return false;
    const std::optional<VolumeBlock> block = blockOf(*volume, item, camera, volumes.addTransfer(*volume));
    if (!block) return false;
    call.volume = static_cast<std::uint32_t>(volumes_.size());
    volumes_.push_back(*block);
    if (item.kind == DrawKind::kMarched) call.mesh.pointParts = marchOf(*volume);
    return true;
}

// By the head and the screen's scale: the same for all tiles, and for both eyes of a head that looks straight at the
// screen.
const DrawItem& DrawCalls::shownOf(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera) {
    const auto* material = item.radius > 0 && item.material ? aspect.get<Material>(item.material) : nullptr;
    if (!material || !material->coarser) return item;
    const double distance = (item.center - camera.headWorld).norm();
    if (!(distance > item.radius)) return item;
    const Mat4d& clip = camera.clip_T_eye;
    const double perUnit = std::max(0.5 * clip(0, 0) * camera.pixels.width, 0.5 * clip(1, 1) * camera.pixels.height);
    const double across = 2 * item.radius * perUnit / (distance * detailStep(camera.detail).coarser);
    ObjectId shown = item.material;
    for (const ObjectId next : coarserOf(aspect, *material)) {
        if (!(across < material->coarserBelow)) break;
        shown = next;
        material = aspect.get<Material>(next);
    }
    if (shown == item.material) return item;
    const bool over = item.over;
    const DrawItem& copy = passOf(aspect, item, shown);
    passItems_.back().over = over;
    return copy;
}

const DrawItem& DrawCalls::passOf(const Aspect& aspect, const DrawItem& item, ObjectId pass) {
    DrawItem& copy = passItems_.emplace_back(item);
    const auto& material = *aspect.get<Material>(pass);
    copy.material = pass;
    copy.over = false;
    if (item.fill == Material::kFilled && item.kind != DrawKind::kTriangles) return copy;
    copy.fill = material.fill;
    copy.kind = material.fill == Material::kFilled ? DrawKind::kTriangles : DrawKind::kLines;
    copy.lineWidth = std::min(item.widestLinePx, material.fill == Material::kEdges     ? material.lineWidth
                                                 : material.fill == Material::kCorners ? material.pointSize
                                                                                       : 0);
    if (material.fill != Material::kFilled) copy.clusters = {};
    return copy;
}

std::uint32_t DrawCalls::look(const Aspect& aspect, ObjectId id, std::uint32_t scopes, LookOf of,
                              TextureCache& textures) {
    auto& known = lookIndices_[static_cast<std::size_t>(of)][id];
    const bool surface = of != LookOf::kNoSurface;
    for (const auto& [in, index] : known)
        if (in == scopes) return index;
    known.emplace_back(scopes, static_cast<std::uint32_t>(looks_.size()));
    static const Material kDefault, kError{.baseColor = {1, 0, 1, 1}, .doubleSided = true, .unlit = true};
    const auto* own = id ? aspect.get<Material>(id) : nullptr;
    const Material& material = own && PersonPrograms::isBad(aspect, *own) ? kError : own ? *own : kDefault;
    DrawLook look{.masked = material.alphaMode == Material::kMask, .doubleSided = material.doubleSided || !surface};
    LookBlock block{};
    block.baseColor = {material.baseColor.x(), material.baseColor.y(), material.baseColor.z(), material.baseColor.w()};
    // Formats without materials give one that says nothing.
    if (of == LookOf::kStudioSurface && saysNoColor(material)) block.baseColor = {0.42f, 0.42f, 0.42f, 1};
    const MaterialTexels texels = texelsOf(material, material.unlit || !surface, scopes);
    block.emissiveAndRoughness = texels.emissiveAndRoughness;
    block.metallic = {texels.metallicLitAndCoat[0], texels.shininessAndScopes[0], 0, 0};
    block.specular = texels.specular;
    block.material[0] = materialIndex(texels);
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
        const GLuint texture = image && textureTarget(*image) == GL_TEXTURE_2D ? textures.find(*image, use) : 0;
        if (texture == 0) {
            look.incomplete = true;
            continue;
        }
        look.maps[i] = {texture, textures.sampler(*image)};
        look.mapBits |= bitOf(static_cast<ImageMap>(i));
        block.places[i] = placeOf(*image);
    }
    block.strengths = {material.normalScale, material.occlusionStrength, material.alphaCutoff, 0};
    block.effects = {material.transmission, material.unlit || !surface ? 1.0f : 0.0f, material.clearcoat,
                     material.clearcoatRoughness};
    if (surface) addLayers(aspect, material, textures, look, block);
    if (own && surface) {
        look.person = persons_.find(aspect, *own);
        look.said = persons_.valuesOf(aspect, *own, look.person, textures);
    }
    looks_.push_back(look);
    lookBlocks_.push_back(block);
    return known.back().second;
}

/// One without an image is nothing, and takes no place.
void DrawCalls::addLayers(const Aspect& aspect, const Material& material, TextureCache& textures, DrawLook& look,
                          LookBlock& block) {
    std::size_t count = 0;
    for (const ObjectId id : material.layers) {
        const auto* layer = aspect.get<TextureLayer>(id);
        if (count == Material::kMostLayers || !layer || !layer->image) continue;
        const auto* image = aspect.get<Image>(layer->image);
        const LayerLookup lookup = image ? lookupOf(layer->source, image->shape) : LayerLookup::kNone;
        const GLuint texture = lookup == LayerLookup::kNone ? 0 : textures.find(*image, ImageUse::kColor);
        if (texture == 0) {
            look.incomplete = true;
            continue;
        }
        look.layers[count] = {texture, textures.sampler(*image)};
        look.layerBits =
            static_cast<std::uint16_t>(look.layerBits | static_cast<unsigned>(lookup) << (kLayerBits * count));
        block.layerPlaces[count] = placeOf(*image);
        block.layers[count] = {static_cast<float>(layer->mode), layer->strength, 0, 0};
        ++count;
    }
}

std::uint32_t DrawCalls::materialIndex(const MaterialTexels& texels) {
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

namespace {

/// The inverse transpose of what makes an ellipsoid of a ball of radius 1. One that is nearly flat is made a little
/// thicker: of what is flatter single precision knows nothing.
Mat3d roundOf(const Mat3d& linear, double radius) {
    constexpr double kThinnest = 1.0 / 256;
    const SingularValues parts = singularValuesOf(radius * linear);
    const Vec3d& lengths = parts.values;
    const double least = std::max(kThinnest * lengths[0], std::numeric_limits<double>::min());
    return parts.u * lengths.cwiseMax(least).cwiseInverse().asDiagonal() * parts.v.transpose();
}

}  // namespace

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
    if (item.kind == DrawKind::kPoints && isStretched(item.world_T_item.linear()))
        cofactors = roundOf(m, item.pointRadius);

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
    const Affine3d world_T_eye = camera.eye_T_world.inverse();
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c)
            block.world_T_eye[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
                static_cast<float>(world_T_eye(r, c));
    block.clipPerPixel = {2.0f / static_cast<float>(camera.pixels.width),
                          2.0f / static_cast<float>(camera.pixels.height), 0, 0};
    if (list.studio) {
        const Vec3d up = eye_R_world.col(1), middle = camera.eye_T_world * list.studio->middle;
        block.studio[0] = four(up.cast<float>(), static_cast<float>(-up.dot(middle)));
        block.studio[1] = four(middle.cast<float>(), static_cast<float>(1 / (list.studio->reach * scale)));
    }
    const Vec3d head = camera.eye_T_world * camera.headWorld;
    block.head = four(head.cast<float>(), 0);
    block.pixelRays = pixelRaysOf(camera, 0, 0);
    return block;
}

std::array<float, 4> pixelRaysOf(const ScreenCamera& camera, int left, int bottom) {
    const Mat4d& clip = camera.clip_T_eye;
    const bool parallel = clip(3, 3) == 1;
    const auto scale = [&](int row, int sizePx) { return 2 / (sizePx * clip(row, row)); };
    const auto offset = [&](int row, int sizePx, int from) {
        return ((parallel ? -clip(row, 3) : clip(row, 2)) - 1 - 2.0 * from / sizePx) / clip(row, row);
    };
    return {static_cast<float>(scale(0, camera.pixels.width)), static_cast<float>(scale(1, camera.pixels.height)),
            static_cast<float>(offset(0, camera.pixels.width, left)),
            static_cast<float>(offset(1, camera.pixels.height, bottom))};
}

}  // namespace tessera
