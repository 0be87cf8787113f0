#include "server/collision/objects/DeformingShapes.h"

#include <algorithm>

namespace tessera {

namespace {

/// Nothing where the array does not fit the mesh.
std::optional<std::vector<Vec3d>> verticesOf(const Blob& positions, std::size_t count) {
    if (!positions.resident() || positions.sizeBytes() != 3 * sizeof(float) * count) return std::nullopt;
    const std::span<const float> xyz = positions.as<float>();
    std::vector<Vec3d> vertices(count);
    for (std::size_t i = 0; i < count; ++i) {
        vertices[i] = Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
        if (!vertices[i].allFinite()) return std::nullopt;
    }
    return vertices;
}

}  // namespace

std::shared_ptr<const CollisionShape> DeformingShapes::follow(const Key& key, const MeshArrays& arrays, bool jump) {
    Own& own = shapes_[key];
    if (own.shape && own.indices == arrays.indices.id()) {
        const BlobId positions = arrays.positions.id();
        if (own.positions == positions) {
            own.end.reset();
            return own.shape;
        }
        if (!jump) {
            if (own.end && own.endPositions == positions) return own.shape;
            own.end = verticesOf(arrays.positions, own.shape->mesh().vertexCount());
            own.endPositions = positions;
            if (own.end) return own.shape;
        }
    }
    own = {ShapeCache::ownShape(arrays, key.choice), arrays.positions.id(), arrays.indices.id(), {}, {}};
    return own.shape;
}

const std::vector<Vec3d>* DeformingShapes::endOf(const Key& key) const {
    const auto own = shapes_.find(key);
    return own != shapes_.end() && own->second.end ? &*own->second.end : nullptr;
}

void DeformingShapes::settle() {
    for (auto& [key, own] : shapes_) {
        if (!own.end) continue;
        const Expected<void> moved = own.shape->move(*own.end);
        TESSERA_CHECK(moved.has_value(), "an end is taken only where its vertices fit the mesh");
        own.positions = own.endPositions;
        own.end.reset();
    }
}

void DeformingShapes::keepOnly(std::span<const Key> keys) {
    std::erase_if(shapes_,
                  [&](const auto& entry) { return !std::binary_search(keys.begin(), keys.end(), entry.first); });
}

}  // namespace tessera
