#include "client/render/MeshCache.h"

#include <algorithm>

#include "common/geometry/Mesh.h"

namespace tessera {

namespace {

bool allOpaque(ByteSpan rgba) {
    for (std::size_t i = 3; i < rgba.size(); i += 4) {
        if (rgba[i] != std::byte{0xff}) return false;
    }
    return true;
}

}  // namespace

const OccluderMesh* RenderMesh::occluder() const {
    if (!occluderBuilt_) {
        occluderBuilt_ = true;
        if (triangles <= OccluderMesh::kMaxTriangles) {
            occluder_ = std::make_unique<OccluderMesh>(positions.as<float>(), indices.as<std::uint32_t>());
        }
    }
    return occluder_.get();
}

std::size_t MeshCache::KeyHash::operator()(const Key& key) const {
    std::size_t h = 0;
    for (const BlobId& id : key) h = h * 0x9E3779B97F4A7C15ull + std::hash<BlobId>{}(id);
    return h;
}

const RenderMesh* MeshCache::of(const Geometry& geometry) {
    const Key key{geometry.positions.id(), geometry.indices.id(), geometry.normals.id(), geometry.colors.id(),
                  geometry.texcoords.id()};
    Entry& entry = meshes_[key];
    entry.usedIn = sweep_;
    if (!entry.complete) {
        const MeshArrays arrays{geometry.positions, geometry.normals, geometry.colors, geometry.texcoords,
                                geometry.indices};
        // A handle that is absent now may be resident the next time.
        entry.complete = true;
        for (const Blob* blob :
             {&arrays.positions, &arrays.normals, &arrays.colors, &arrays.texcoords, &arrays.indices})
            entry.complete = entry.complete && (blob->empty() || blob->resident());
        entry.mesh = std::make_unique<RenderMesh>();
        RenderMesh& mesh = *entry.mesh;
        mesh.positions = geometry.positions;
        mesh.indices = geometry.indices;
        if (checkMesh(arrays)) {
            mesh.bounds = boundsOf(geometry.positions.as<float>());
            mesh.triangles = geometry.indices.as<std::uint32_t>().size() / 3;
            mesh.opaque = allOpaque(geometry.colors.bytes());
        }
    }
    return entry.mesh.get();
}

bool MeshCache::opaque(const Image& image) {
    ImageEntry& entry = images_[image.pixels.id()];
    if (entry.usedIn == 0 || !image.pixels.resident()) {
        entry.opaque = image.pixels.resident() && allOpaque(image.pixels.bytes());
    }
    entry.usedIn = image.pixels.resident() ? sweep_ : 0;
    return entry.opaque;
}

void MeshCache::endSweep() {
    std::erase_if(meshes_, [this](const auto& item) { return item.second.usedIn != sweep_; });
    std::erase_if(images_, [this](const auto& item) { return item.second.usedIn != sweep_; });
}

}  // namespace tessera
