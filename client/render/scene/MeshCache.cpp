#include "client/render/scene/MeshCache.h"

#include <algorithm>
#include <cmath>

#include "common/geometry/MeshCopies.h"
#include "common/geometry/Points.h"

namespace tessera {

bool allOpaque(ByteSpan rgba) {
    for (std::size_t i = 3; i < rgba.size(); i += 4) {
        if (rgba[i] != std::byte{0xff}) return false;
    }
    return true;
}

/// Of copies: as many in each as others have triangles.
static std::vector<MeshCluster> clustersOfCopies(const MeshArrays& arrays) {
    std::vector<MeshCluster> clusters;
    const std::size_t count = copyCount(arrays);
    for (std::size_t first = 0; first < count; first += MeshCluster::kTriangles) {
        const Box box = boundsOfCopies(arrays, first, std::min(first + MeshCluster::kTriangles, count));
        // A little larger than rounding takes away.
        clusters.push_back({.centre = box.center().cast<float>(),
                            .half = (0.5 * box.size() + 1e-6 * (box.size() + box.center().cwiseAbs())).cast<float>()});
    }
    return clusters;
}

const OccluderMesh* RenderMesh::occluder() const {
    if (!occluderBuilt_) {
        occluderBuilt_ = true;
        if (rowOf(kind()).ownTriangles && triangles <= OccluderMesh::mostTriangles(!clusters().empty())) {
            occluder_ =
                std::make_unique<OccluderMesh>(arrays().positions.as<float>(), arrays().indices.as<std::uint32_t>());
        }
    }
    return occluder_.get();
}

const RenderMesh* MeshCache::acquire(const Drawable& drawable) {
    if (!drawable.resident()) return nullptr;
    const MeshArrays arrays = drawable.arrays();
    const auto [it, isNew] = meshes_.try_emplace(keyOf(arrays));
    RenderMesh& mesh = it->second;
    ++mesh.users_;
    if (!isNew) return &mesh;
    const auto drawn = std::make_shared<DrawMesh>(
        DrawMesh{.serial = nextSerial(), .key = it->first, .arrays = arrays, .clusters = {}});
    mesh.drawn = drawn;
    if (!prepareFromOrigin(mesh, arrays)) prepare(mesh, *drawn);
    drawn->sound = !mesh.refused;
    // Copies have boxes as single precision places them.
    if (drawable.hasOwnBounds() && arrays.copies.empty() && !mesh.bounds.empty()) mesh.bounds = drawable.bounds();
    return &mesh;
}

void MeshCache::prepare(RenderMesh& mesh, DrawMesh& drawn) {
    const MeshArrays& arrays = drawn.arrays;
    mesh.refused = !checkMesh(arrays);
    if (mesh.refused) return;
    mesh.opaque = allOpaque(arrays.colors.bytes());
    if (mesh.kind() == MeshKind::kGlyphs) {
        mesh.triangles = triangleCount(arrays);
        drawn.clusters = clustersOfCopies(arrays);
        for (const MeshCluster& cluster : drawn.clusters) mesh.bounds.extend(cluster.box());
        return;
    }
    const std::size_t vertices = arrays.positions.as<float>().size() / 3;
    mesh.boxes_.resize((vertices + RenderMesh::kVerticesPerBox - 1) / RenderMesh::kVerticesPerBox);
    mesh.boundVertices({0, vertices});
    const std::size_t places = mesh.kind() == MeshKind::kStreaks ? 2 : 1;
    mesh.triangles = rowOf(mesh.kind()).particles ? 2 * (vertices / places) : triangleCount(arrays);
    mesh.lines = arrays.lines.sizeBytes() / (2 * sizeof(std::uint32_t));
    if (rowOf(mesh.kind()).ownTriangles)
        drawn.clusters = clustersOf(arrays.positions.as<float>(), arrays.indices.as<std::uint32_t>());
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
    const std::span<const float> numbers = arrays().positions.as<float>();
    const std::size_t perBox = 3 * kVerticesPerBox;
    for (std::size_t i = vertices.begin / kVerticesPerBox; i * kVerticesPerBox < vertices.end; ++i)
        boxes_[i] = boundsOf(numbers.subspan(i * perBox, std::min(perBox, numbers.size() - i * perBox)));
    bounds = Box();
    for (const Box& box : boxes_) bounds.extend(box);
    if (rowOf(kind()).particles && !bounds.empty()) {
        bounds.lower.array() -= arrays().pointRadius;
        bounds.upper.array() += arrays().pointRadius;
    }
    if (kind() != MeshKind::kPoints) return;
    shownRadius = tessera::shownRadius(arrays().pointRadius, bounds);
    bounds = boundsOfPoints(bounds, arrays().pointRadius);
}

void MeshCache::release(const RenderMesh* mesh) {
    if (!mesh) return;
    const auto it = meshes_.find(mesh->drawn->key);
    TESSERA_CHECK(it != meshes_.end() && it->second.users_ > 0, "a mesh is released by who acquired it");
    if (--it->second.users_ == 0) unused_.push_back(mesh->drawn->key);
}

void MeshCache::dropUnused() {
    for (const MeshKey& key : unused_) {
        const auto it = meshes_.find(key);
        if (it != meshes_.end() && it->second.users_ == 0) meshes_.erase(it);
    }
    unused_.clear();
}

}  // namespace tessera
