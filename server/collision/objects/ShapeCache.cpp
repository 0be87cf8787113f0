#include "server/collision/objects/ShapeCache.h"

namespace tessera {

namespace {

std::optional<TriangleMesh> meshOf(const MeshArrays& arrays) {
    if (!arrays.positions.resident() || !arrays.indices.resident()) return std::nullopt;
    // Whole elements only: a ragged tail makes the arrays malformed.
    if (arrays.positions.sizeBytes() % sizeof(float) != 0 ||
        arrays.indices.sizeBytes() % sizeof(std::uint32_t) != 0)
        return std::nullopt;
    Expected<TriangleMesh> mesh =
        TriangleMesh::make(arrays.positions.as<float>(), arrays.indices.as<std::uint32_t>());
    if (!mesh || mesh->faceCount() == 0) return std::nullopt;
    return std::move(*mesh);
}

/// A small ball around points: its centre goes towards the farthest one in ever shorter steps (Badoiu and Clarkson,
/// Smaller core-sets for balls, SODA 2003).
void setBall(CollisionShape& shape, std::span<const Vec3d> points) {
    constexpr int kSteps = 64;
    const auto farthest = [&](const Vec3d& centre) {
        std::size_t best = 0;
        for (std::size_t i = 1; i < points.size(); ++i)
            if ((points[i] - centre).squaredNorm() > (points[best] - centre).squaredNorm()) best = i;
        return best;
    };
    Vec3d centre = shape.hull->bounds().center();
    shape.ballCentre = centre;
    shape.ballRadius = (points[farthest(centre)] - centre).stableNorm();
    for (int step = 1; step <= kSteps; ++step) {
        centre += (points[farthest(centre)] - centre) / (step + 1);
        const double radius = (points[farthest(centre)] - centre).stableNorm();
        if (!(radius < shape.ballRadius)) continue;
        shape.ballCentre = centre;
        shape.ballRadius = radius;
    }
    // So that rounding leaves no point outside.
    shape.ballRadius *= 1 + 1e-14;
}

/// The hull's own triangles: every query about surfaces works on them.
std::shared_ptr<const CollisionShape> hullShape(const TriangleMesh& mesh) {
    Expected<ConvexHull> hull = ConvexHull::make(mesh);
    if (!hull || hull->dimension() < 3) return nullptr;
    std::vector<double> positions;
    positions.reserve(3 * hull->vertices().size());
    for (const Vec3d& v : hull->vertices()) positions.insert(positions.end(), {v.x(), v.y(), v.z()});
    std::vector<std::uint32_t> indices;
    indices.reserve(3 * hull->faces().size());
    for (const ConvexHull::Face& face : hull->faces()) indices.insert(indices.end(), face.begin(), face.end());
    Expected<TriangleMesh> surface = TriangleMesh::make(std::span<const double>(positions), indices);
    TESSERA_CHECK(surface.has_value(), "a hull's own faces are a mesh");
    auto shape = std::make_shared<CollisionShape>(
        CollisionShape{.tree = TriangleTree(std::move(*surface)), .hull = std::move(*hull)});
    setBall(*shape, shape->hull->vertices());
    return shape;
}

}  // namespace

std::shared_ptr<const CollisionShape> ShapeCache::shape(const MeshArrays& arrays, ShapeKind kind) {
    // What is not here yet may come: nothing is remembered about it.
    if (!arrays.positions.resident() || !arrays.indices.resident()) return nullptr;
    const Key key{arrays.positions.id(), arrays.indices.id(), kind};
    if (const auto known = shapes_.find(key); known != shapes_.end()) return known->second;
    std::shared_ptr<const CollisionShape> made;
    if (std::optional<TriangleMesh> mesh = meshOf(arrays))
        made =
            kind == ShapeKind::kHull
                ? hullShape(*mesh)
                : std::make_shared<const CollisionShape>(CollisionShape{.tree = TriangleTree(std::move(*mesh))});
    return shapes_[key] = std::move(made);
}

std::shared_ptr<CollisionShape> ShapeCache::ownShape(const MeshArrays& arrays) {
    std::optional<TriangleMesh> mesh = meshOf(arrays);
    if (!mesh) return nullptr;
    return std::make_shared<CollisionShape>(CollisionShape{.tree = TriangleTree(std::move(*mesh))});
}

Box ShapeCache::bounds(const MeshArrays& arrays) {
    if (!arrays.positions.resident()) return {};
    const auto [place, isNew] = bounds_.try_emplace(arrays.positions.id());
    if (isNew) {
        const std::span<const float> xyz = arrays.positions.as<float>();
        for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
            const Vec3d p(xyz[i], xyz[i + 1], xyz[i + 2]);
            if (p.allFinite()) place->second.extend(p);
        }
    }
    return place->second;
}

void ShapeCache::forgetIdle() {
    std::size_t idle = 0;
    for (const auto& [key, shape] : shapes_)
        if (shape.use_count() == 1) idle += shape->tree.mesh().faceCount();
    if (idle <= maxIdleTriangles_) return;
    std::erase_if(shapes_, [](const auto& entry) { return entry.second.use_count() <= 1; });
    bounds_.clear();
}

}  // namespace tessera
