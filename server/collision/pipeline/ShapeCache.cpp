#include "server/collision/pipeline/ShapeCache.h"

namespace tessera {

std::shared_ptr<const AabbTree> ShapeCache::shape(const Geometry& geometry) {
    if (!geometry.positions.resident() || !geometry.indices.resident()) return nullptr;
    const Key key{geometry.positions.id(), geometry.indices.id()};
    if (const auto known = shapes_.find(key); known != shapes_.end()) return known->second;
    // Whole elements only: a ragged tail makes the arrays malformed.
    if (geometry.positions.sizeBytes() % sizeof(float) != 0 ||
        geometry.indices.sizeBytes() % sizeof(std::uint32_t) != 0)
        return shapes_[key] = nullptr;
    Expected<TriangleMesh> mesh =
        TriangleMesh::make(geometry.positions.as<float>(), geometry.indices.as<std::uint32_t>());
    std::shared_ptr<const AabbTree> tree;
    if (mesh && mesh->faceCount() > 0) tree = std::make_shared<const AabbTree>(std::move(*mesh));
    return shapes_[key] = std::move(tree);
}

Box ShapeCache::bounds(const Geometry& geometry) {
    if (!geometry.positions.resident()) return {};
    const auto [place, isNew] = bounds_.try_emplace(geometry.positions.id());
    if (isNew) {
        const std::span<const float> xyz = geometry.positions.as<float>();
        for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
            const Vec3d p(xyz[i], xyz[i + 1], xyz[i + 2]);
            if (p.allFinite()) place->second.extend(p);
        }
    }
    return place->second;
}

void ShapeCache::forgetIdle() {
    std::size_t idle = 0;
    for (const auto& [key, tree] : shapes_)
        if (tree.use_count() == 1) idle += tree->mesh().faceCount();
    if (idle <= maxIdleTriangles_) return;
    std::erase_if(shapes_, [](const auto& entry) { return entry.second.use_count() <= 1; });
    bounds_.clear();
}

}  // namespace tessera
