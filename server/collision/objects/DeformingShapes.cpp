#include "server/collision/objects/DeformingShapes.h"

#include <algorithm>

namespace tessera {

namespace {

/// Nothing where they are not as many as the mesh has, or not finite.
std::optional<std::vector<Vec3d>> verticesOf(std::span<const float> xyz, std::size_t count) {
    if (xyz.size() != 3 * count) return std::nullopt;
    std::vector<Vec3d> vertices(count);
    for (std::size_t i = 0; i < count; ++i) {
        vertices[i] = Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
        if (!vertices[i].allFinite()) return std::nullopt;
    }
    return vertices;
}

/// Nothing where the arrays do not fit the mesh.
std::optional<std::vector<Vec3d>> verticesOf(const MeshArrays& arrays, std::size_t count) {
    if (arrays.primitive == Primitive::kPoints) {
        const std::optional<MeshData> octahedra = octahedraOf(arrays);
        return octahedra ? verticesOf(octahedra->positions, count) : std::nullopt;
    }
    if (!arrays.positions.resident() || arrays.positions.sizeBytes() % sizeof(float) != 0) return std::nullopt;
    return verticesOf(arrays.positions.as<float>(), count);
}

}  // namespace

std::shared_ptr<const CollisionShape> DeformingShapes::follow(const Key& key, const MeshArrays& arrays, bool jump) {
    Own& own = shapes_[key];
    if (own.shape && own.indices == arrays.indices.id() && own.primitive == arrays.primitive &&
        own.pointRadius == arrays.pointRadius) {
        const BlobId positions = arrays.positions.id();
        if (own.positions == positions) {
            own.end.reset();
            return own.shape;
        }
        if (!jump) {
            if (own.end && own.endPositions == positions) return own.shape;
            own.end = verticesOf(arrays, own.shape->mesh().vertexCount());
            own.endPositions = positions;
            if (own.end) return own.shape;
        }
    }
    own = {.shape = ShapeCache::ownShape(arrays, key.choice),
           .positions = arrays.positions.id(),
           .indices = arrays.indices.id(),
           .primitive = arrays.primitive,
           .pointRadius = arrays.pointRadius,
           .endPositions = {},
           .end = {}};
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
