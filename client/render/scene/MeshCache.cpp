#include "client/render/scene/MeshCache.h"

#include <algorithm>
#include <cmath>

#include "common/geometry/Points.h"

namespace tessera {

bool allOpaque(ByteSpan rgba) {
    for (std::size_t i = 3; i < rgba.size(); i += 4) {
        if (rgba[i] != std::byte{0xff}) return false;
    }
    return true;
}

const OccluderMesh* RenderMesh::occluder() const {
    if (!occluderBuilt_) {
        occluderBuilt_ = true;
        if (rowOf(kind).ownTriangles && triangles <= OccluderMesh::mostTriangles(!clusters.empty())) {
            occluder_ = std::make_unique<OccluderMesh>(positions.as<float>(), indices.as<std::uint32_t>());
        }
    }
    return occluder_.get();
}

const RenderMesh* MeshCache::acquire(const Drawable& drawable) {
    if (!drawable.resident()) return nullptr;
    const auto [it, isNew] = meshes_.try_emplace(drawable.key());
    RenderMesh& mesh = it->second;
    ++mesh.users_;
    if (!isNew) return &mesh;
    const MeshArrays arrays = drawable.arrays();
    mesh.key_ = it->first;
    mesh.positions = arrays.positions;
    mesh.indices = arrays.indices;
    mesh.kind = kindOf(arrays);
    if (mesh.kind == DrawKind::kLines) mesh.lineEnds = arrays.lines;
    if (mesh.kind == DrawKind::kSlices) mesh.slices = arrays.texcoords;
    mesh.pointRadius = arrays.pointRadius;
    if (!prepareFromOrigin(mesh, arrays)) prepare(mesh, arrays);
    if (drawable.hasOwnBounds() && !mesh.bounds.empty()) mesh.bounds = drawable.bounds();
    return &mesh;
}

void MeshCache::prepare(RenderMesh& mesh, const MeshArrays& arrays) {
    mesh.refused = !checkMesh(arrays);
    if (mesh.refused) return;
    const std::size_t vertices = arrays.positions.as<float>().size() / 3;
    mesh.boxes_.resize((vertices + RenderMesh::kVerticesPerBox - 1) / RenderMesh::kVerticesPerBox);
    mesh.boundVertices({0, vertices});
    const std::size_t places = mesh.kind == DrawKind::kStreaks ? 2 : 1;
    mesh.triangles = rowOf(mesh.kind).particles ? 2 * (vertices / places) : triangleCount(arrays);
    mesh.lines = arrays.lines.sizeBytes() / (2 * sizeof(std::uint32_t));
    mesh.opaque = allOpaque(arrays.colors.bytes());
    if (rowOf(mesh.kind).ownTriangles)
        mesh.clusters = clustersOf(arrays.positions.as<float>(), arrays.indices.as<std::uint32_t>());
}

bool MeshCache::prepareFromOrigin(RenderMesh& mesh, const MeshArrays& arrays) {
    for (const MeshOrigin& origin : originsOf(arrays)) {
        const auto known = meshes_.find(origin.key);
        if (known == meshes_.end() || known->second.boxes_.empty() || !soundWithin(arrays, origin.changed)) continue;
        const RenderMesh& before = known->second;
        mesh.triangles = before.triangles;
        mesh.lines = before.lines;
        mesh.opaque = origin.changed[2].empty() ? before.opaque : allOpaque(arrays.colors.bytes());
        mesh.boxes_ = before.boxes_;
        mesh.bounds = before.bounds;
        mesh.shownRadius = before.shownRadius;
        if (!origin.changed[0].empty()) mesh.boundVertices(elementsOf(origin.changed[0], 3 * sizeof(float)));
        return true;
    }
    return false;
}

void RenderMesh::boundVertices(const ByteRange& vertices) {
    const std::span<const float> numbers = positions.as<float>();
    const std::size_t perBox = 3 * kVerticesPerBox;
    for (std::size_t i = vertices.begin / kVerticesPerBox; i * kVerticesPerBox < vertices.end; ++i)
        boxes_[i] = boundsOf(numbers.subspan(i * perBox, std::min(perBox, numbers.size() - i * perBox)));
    bounds = Box();
    for (const Box& box : boxes_) bounds.extend(box);
    if (rowOf(kind).particles && !bounds.empty()) {
        bounds.lower.array() -= std::abs(pointRadius);
        bounds.upper.array() += std::abs(pointRadius);
    }
    if (kind != DrawKind::kPoints) return;
    shownRadius = tessera::shownRadius(pointRadius, bounds);
    bounds = boundsOfPoints(bounds, pointRadius);
}

void MeshCache::release(const RenderMesh* mesh) {
    if (!mesh) return;
    const auto it = meshes_.find(mesh->key_);
    TESSERA_CHECK(it != meshes_.end() && it->second.users_ > 0, "a mesh is released by who acquired it");
    if (--it->second.users_ == 0) unused_.push_back(mesh->key_);
}

void MeshCache::dropUnused() {
    for (const MeshKey& key : unused_) {
        const auto it = meshes_.find(key);
        if (it != meshes_.end() && it->second.users_ == 0) meshes_.erase(it);
    }
    unused_.clear();
}

}  // namespace tessera
