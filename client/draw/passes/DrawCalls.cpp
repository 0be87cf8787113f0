#include "client/draw/passes/DrawCalls.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/Decompositions.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

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

}  // namespace

void DrawCalls::begin(const ScreenCamera& camera, const DrawStores& stores) {
    calls_.clear();
    layerItems_.clear();
    recordItems_.clear();
    blocks_.clear();
    blockRecords_.clear();
    volumes_.clear();
    sortedIndices_.clear();
    parts_.clear();
    found_ = {};
    widestLineReachPx_ = 0;
    stores.budget.beginDraw();
    stores.textures.limitAnisotropy(detailStep(camera.detail).anisotropy);
    stores.volumes.beginList();
    stores.looks.beginDraw();
}

void DrawCalls::collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                        const DrawStores& stores) {
    begin(camera, stores);
    scoped_ = std::ranges::any_of(list.lights, [](const LightItem& light) { return light.scope != 0; });
    inStudio_ = list.studio.has_value();
    counts_ = {.items = list.opaque.size()};
    stores.looks.setBackground(list.environment.background);
    for (const DrawItem& listed : list.opaque) {
        const Shown shown = shownOf(listed, camera);
        // Of what is at one depth the first is seen: the last pass comes first, the material itself last.
        const std::span<const DrawMaterial::Layer> passes = shown.passes();
        for (auto pass = passes.rbegin(); pass != passes.rend(); ++pass)
            if (!pass->blended) add(aspect, layerOf(shown.item, *pass), pass->look.get(), camera, stores);
        add(aspect, shown.item, shown.source(), camera, stores);
    }
    opaqueCount_ = calls_.size();
    for (const DrawItem& listed : list.transparent) {
        const Shown shown = shownOf(listed, camera);
        const DrawItem& item = shown.item;
        if (item.sortedCount == 0) {
            counts_.items += !item.over;
            if (!item.over) add(aspect, item, shown.source(), camera, stores);
            for (const DrawMaterial::Layer& pass : shown.passes())
                if ((!item.over || pass.blended) && add(aspect, layerOf(item, pass), pass.look.get(), camera, stores))
                    calls_.back().equal = item.over;
            continue;
        }
        const auto [seen, isNew] = parts_.try_emplace(item.node);
        counts_.items += isNew;
        if (isNew && add(aspect, item, shown.source(), camera, stores)) {
            seen->second = partOf(shown, stores);
            calls_.pop_back();
        }
        const Part& part = seen->second;
        if (!part.there) continue;
        DrawCall call = part.call;
        call.item = &item;
        call.firstSorted = addSorted(list, item, part.indices);
        call.sortedCount = 3 * item.sortedCount;
        calls_.push_back(call);
        // Over each part in its turn; outlines over the whole of it, behind its first part.
        const std::span<const DrawMaterial::Layer> passes = shown.passes();
        for (std::size_t i = 0; i < passes.size(); ++i) {
            const DrawMaterial::Layer& pass = passes[i];
            if (pass.fill != Material::kFilled && rowOf(item.kind).ownTriangles) {
                if (isNew) add(aspect, layerOf(item, pass), pass.look.get(), camera, stores);
                continue;
            }
            DrawCall& over = calls_.emplace_back(call);
            if (const auto own = std::ranges::find(part.mapped, i, &Part::Mapped::pass); own != part.mapped.end()) {
                over.mesh = own->mesh;
                over.firstSorted = addSorted(list, item, own->indices);
            }
            over.look = stores.looks.find(aspect, pass.look.get(), scoped_ ? item.scopes : 0, LookTable::Of::kSurface,
                                          stores.textures);
        }
    }
    makeRecords(camera);
}

DrawCalls::Part DrawCalls::partOf(const Shown& shown, const DrawStores& stores) {
    const DrawItem& item = shown.item;
    const bool triangles = item.kind == MeshKind::kTriangles;
    Part part{
        calls_.back(), drawnArrays(*item.mesh, triangles ? normalMapOf(shown.source()) : nullptr).indices, true, {}};
    if (!triangles) return part;
    const std::span<const DrawMaterial::Layer> passes = shown.passes();
    for (std::size_t i = 0; i < passes.size(); ++i) {
        // Without a normal map it is drawn as it lies in GL already.
        const Image* normalMap = passes[i].fill == Material::kFilled ? normalMapOf(passes[i].look.get()) : nullptr;
        const MeshRange* mesh = normalMap ? stores.meshes.find(*item.mesh, Material::kFilled, normalMap) : nullptr;
        if (mesh && *mesh != part.call.mesh)
            part.mapped.push_back({i, *mesh, drawnArrays(*item.mesh, normalMap).indices});
    }
    return part;
}

std::uint32_t DrawCalls::addSorted(const DrawList& list, const DrawItem& part, const Blob& indices) {
    const auto first = static_cast<std::uint32_t>(sortedIndices_.size());
    const std::span<const std::uint32_t> all = indices.as<std::uint32_t>();
    for (const std::uint32_t t : std::span(list.sortedTriangles).subspan(part.sortedFrom, part.sortedCount)) {
        const std::array<std::uint32_t, 3> corners = cornersOf(part.kind, all, t);
        sortedIndices_.insert(sortedIndices_.end(), corners.begin(), corners.end());
    }
    return first;
}

void DrawCalls::collectDepth(const Aspect& aspect, std::span<const DrawItem> items, const ScreenCamera& camera,
                             const DrawStores& stores) {
    begin(camera, stores);
    scoped_ = inStudio_ = false;
    counts_ = {.items = items.size()};
    for (const DrawItem& item : items) {
        // What is solid with one of its layers is solid. Without a material no layer cuts, whatever became of the look
        // since (ShadowCasters.h).
        const bool cuts = item.look && item.material;
        bool whole = !cuts;
        const auto addLayer = [&](const DrawMaterial::Layer& layer) {
            if (layer.look->shapes)
                add(aspect, item, layer.look.get(), camera, stores);
            else
                whole = true;
        };
        if (cuts) {
            const DrawMaterial::Level& level = item.look->levels.front();
            addLayer(level.own);
            for (const DrawMaterial::Layer& pass : level.passes)
                if (!pass.blended && pass.fill == Material::kFilled) addLayer(pass);
        }
        if (whole) add(aspect, item, nullptr, camera, stores);
    }
    opaqueCount_ = calls_.size();
    makeRecords(camera);
}

void DrawCalls::makeRecords(const ScreenCamera& camera) {
    recordMaker_.make(recordItems_, camera, records_);
    for (const std::uint32_t record : blockRecords_) blocks_.push_back({records_[record]});
}

bool DrawCalls::add(const Aspect& aspect, const DrawItem& item, const LookSource* source, const ScreenCamera& camera,
                    const DrawStores& stores) {
    if (step_) step_();
    // Also what shows nothing of its look is drawn as it lies in GL already.
    const LookSource* placed = source ? source : item.look ? item.look->levels.front().own.look.get() : nullptr;
    const Image* normalMap = normalMapOf(placed);
    // Neighbours in a list are of one mesh.
    if (!item.mesh || item.mesh.get() != found_.mesh || item.fill != found_.fill || normalMap != found_.normalMap)
        found_ = {item.mesh.get(), item.fill, normalMap,
                  item.mesh ? stores.meshes.find(*item.mesh, item.fill, normalMap) : nullptr};
    const MeshRange* mesh = found_.range;
    const bool fits = mesh && mesh->kind == item.kind;
    if (!fits) ++counts_.skipped;
    if (!fits || mesh->indexCount == 0) return false;
    const std::uint32_t look = stores.looks.find(aspect, source, scoped_ ? item.scopes : 0,
                                                 !rowOf(item.kind).surface       ? LookTable::Of::kNoSurface
                                                 : inStudio_ && !mesh->hasColors ? LookTable::Of::kStudioSurface
                                                                                 : LookTable::Of::kSurface,
                                                 stores.textures);
    if (stores.looks[look].incomplete) ++counts_.untextured;
    if (item.lineWidth > 0) widestLineReachPx_ = std::max(widestLineReachPx_, lineReachPx(item.lineWidth));
    DrawCall call{.mesh = *mesh,
                  .record = static_cast<std::uint32_t>(recordItems_.size()),
                  .block = static_cast<std::uint32_t>(blockRecords_.size()),
                  .look = look,
                  .mirrored = item.mirrored,
                  .item = &item};
    if (rowOf(item.kind).volume && !addVolume(aspect, item, camera, stores.volumes, call)) {
        ++counts_.skipped;
        return false;
    }
    if (formOf(item.kind).balls && isStretched(item.world_T_item.linear())) call.mesh.pointParts |= kPointStretched;
    if (isLarge(call)) blockRecords_.push_back(call.record);
    calls_.push_back(call);
    recordItems_.push_back(&item);
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
    if (item.kind == MeshKind::kMarched) call.mesh.pointParts = marchOf(*volume);
    return true;
}

// By the head and the screen's scale: the same for all tiles, and for both eyes of a head that looks straight at the
// screen.
DrawCalls::Shown DrawCalls::shownOf(const DrawItem& item, const ScreenCamera& camera) {
    if (!item.look) return {item, nullptr};
    const std::vector<DrawMaterial::Level>& levels = item.look->levels;
    const Shown own{item, &levels.front()};
    if (levels.size() == 1 || item.box.empty()) return own;
    const double radius = 0.5 * item.box.size().norm(), distance = (item.box.center() - camera.headWorld).norm();
    if (!(radius > 0 && distance > radius)) return own;
    const Mat4d& clip = camera.clip_T_eye;
    const double perUnit = std::max(0.5 * clip(0, 0) * camera.pixels.width, 0.5 * clip(1, 1) * camera.pixels.height);
    const double across = 2 * radius * perUnit / (distance * detailStep(camera.detail).coarser);
    std::size_t level = 0;
    while (level + 1 < levels.size() && across < levels[level].coarserBelow) ++level;
    if (level == 0) return own;
    const DrawItem& copy = layerOf(item, levels[level].own);
    layerItems_.back().over = item.over;
    return {copy, &levels[level]};
}

const DrawItem& DrawCalls::layerOf(const DrawItem& item, const DrawMaterial::Layer& layer) {
    DrawItem& copy = layerItems_.emplace_back(item);
    copy.material = layer.look->material;
    copy.over = false;
    if (item.fill == Material::kFilled && item.kind != MeshKind::kTriangles) return copy;
    copy.fill = layer.fill;
    copy.kind = layer.fill == Material::kFilled ? MeshKind::kTriangles : MeshKind::kLines;
    copy.lineWidth = std::min(item.widestLinePx, layer.lineWidth);
    if (layer.fill != Material::kFilled) copy.clusters = {};
    return copy;
}

FrameBlock makeFrameBlock(const DrawList& list, const ScreenCamera& camera) {
    // Metres per world unit: a wall may stand in a world of any scale.
    const double scale = std::cbrt(std::abs(camera.eye_T_world.linear().determinant()));
    const Mat3d eye_R_world = camera.eye_T_world.linear() / (scale > 0 ? scale : 1.0);
    const Mat3d world_R_eye =
        Eigen::AngleAxisd(list.environment.image ? -list.environment.turn : 0.0, Vec3d::UnitY()).toRotationMatrix() *
        eye_R_world.transpose();
    FrameBlock block{};
    for (int i = 0; i < 3; ++i) {
        const Vec3d row = world_R_eye.row(i);
        block.world_R_eye[static_cast<std::size_t>(i)] = four(row.cast<float>(), 0);
    }
    block.sky = four(list.environment.sky, static_cast<float>(std::exp2(double{list.environment.exposure})));
    block.ground = four(list.environment.ground, 0);
    const Affine3d world_T_eye = camera.eye_T_world.inverse();
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c)
            block.world_T_eye[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
                static_cast<float>(world_T_eye(r, c));
    if (list.studio) {
        const Vec3d up = eye_R_world.col(1), middle = camera.eye_T_world * list.studio->middle;
        block.studio[0] = four(up.cast<float>(), static_cast<float>(-up.dot(middle)));
        block.studio[1] = four(middle.cast<float>(), static_cast<float>(1 / (list.studio->reach * scale)));
    }
    const Vec3d head = camera.eye_T_world * camera.headWorld;
    block.head = four(head.cast<float>(), 0);
    project(block, camera);
    return block;
}

void project(FrameBlock& block, const ScreenCamera& camera) {
    const Mat4d clip_T_eye = reversedDepth(camera.clip_T_eye);
    block.clip_T_eye = columnsOf(clip_T_eye);
    block.eye_T_clip = columnsOf(clip_T_eye.inverse());
    block.clipPerPixel = {2.0f / static_cast<float>(camera.pixels.width),
                          2.0f / static_cast<float>(camera.pixels.height), 0, 0};
    block.pixelRays = pixelRaysOf(camera, 0, 0);
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
