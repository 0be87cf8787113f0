#include "client/render/MeshCache.h"

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
        if (triangles <= OccluderMesh::kMaxTriangles) {
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
    if (checkMesh(arrays)) {
        mesh.bounds = boundsOf(arrays.positions.as<float>());
        mesh.triangles = arrays.indices.as<std::uint32_t>().size() / 3;
        mesh.opaque = allOpaque(arrays.colors.bytes());
    }
    return &mesh;
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
