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

std::shared_ptr<const CollisionShape> DeformingShapes::follow(ObjectId core, const MeshArrays& arrays, bool jump) {
    Own& own = shapes_[core];
    if (own.shape && own.indices == arrays.indices.id()) {
        const BlobId positions = arrays.positions.id();
        if (own.positions == positions) {
            own.end.reset();
            return own.shape;
        }
        if (!jump) {
            if (own.end && own.endPositions == positions) return own.shape;
            own.end = verticesOf(arrays.positions, own.shape->tree.mesh().vertexCount());
            own.endPositions = positions;
            if (own.end) return own.shape;
        }
    }
    own = {ShapeCache::ownShape(arrays), arrays.positions.id(), arrays.indices.id(), {}, {}};
    return own.shape;
}

const std::vector<Vec3d>* DeformingShapes::endOf(ObjectId core) const {
    const auto own = shapes_.find(core);
    return own != shapes_.end() && own->second.end ? &*own->second.end : nullptr;
}

void DeformingShapes::settle() {
    for (auto& [core, own] : shapes_) {
        if (!own.end) continue;
        TriangleTree& tree = own.shape->tree;
        const Expected<void> fitted = tree.refit(*own.end);
        TESSERA_CHECK(fitted.has_value(), "an end is taken only where its vertices fit the mesh");
        if (tree.decay() > TriangleTree::kRebuildAbove) tree.rebuild();
        own.positions = own.endPositions;
        own.end.reset();
    }
}

void DeformingShapes::keepOnly(std::span<const ObjectId> cores) {
    std::erase_if(shapes_,
                  [&](const auto& entry) { return !std::binary_search(cores.begin(), cores.end(), entry.first); });
}

}  // namespace tessera
