#include "server/collision/dynamics/ShapeMemory.h"

#include <cmath>

namespace tessera::dynamics {

namespace {

bool same(const Box& a, const Box& b) {
    return a.lower == b.lower && a.upper == b.upper;
}

std::unique_ptr<SurfaceData> make(const TriangleTree& tree, const ConvexHull* hull) {
    auto out = std::make_unique<SurfaceData>();
    const TriangleMesh& mesh = tree.mesh();
    out->vertices = mesh.vertexCount();
    out->faces = mesh.faceCount();
    out->bounds = mesh.bounds();
    bool closed = true;
    if (hull != nullptr) {
        out->solid = solidShape(*hull);
    } else {
        out->topology = std::make_unique<SurfaceTopology>(mesh);
        closed = out->topology->closed();
    }
    if (closed) out->moments = momentsOf(mesh);
    const double size = mesh.bounds().empty() ? 0 : mesh.bounds().size().norm();
    if (!(std::abs(out->moments.volume) > 1e-9 * size * size * size)) out->moments = momentsOf(mesh.bounds());
    return out;
}

}  // namespace

const SurfaceData& ShapeMemory::of(const TriangleTree& tree, const ConvexHull* hull, std::uint64_t frame) {
    std::unique_ptr<SurfaceData>& data = surfaces_[&tree];
    const TriangleMesh& mesh = tree.mesh();
    const bool known = data != nullptr && data->vertices == mesh.vertexCount() && data->faces == mesh.faceCount() &&
                       data->solid.has_value() == (hull != nullptr) && same(data->bounds, mesh.bounds()) &&
                       (hull == nullptr || data->solid->corners.size() == hull->vertices().size());
    if (!known) data = make(tree, hull);
    data->usedInFrame = frame;
    return *data;
}

void ShapeMemory::forget(std::uint64_t before) {
    std::erase_if(surfaces_, [&](const auto& entry) { return entry.second->usedInFrame < before; });
}

}  // namespace tessera::dynamics
