#include "server/collision/rigid_bodies/ShapeMemory.h"

#include <cmath>
#include <utility>

namespace tessera::rigid {

namespace {

bool same(const Box& a, const Box& b) {
    return a.lower == b.lower && a.upper == b.upper;
}

std::unique_ptr<SurfaceData> make(const TriangleTree& tree, const ConvexHull* hull) {
    auto out = std::make_unique<SurfaceData>();
    const TriangleMesh& mesh = tree.mesh();
    out->vertices = mesh.vertexCount();
    out->faces = mesh.faceCount();
    out->moves = mesh.moves();
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
                       data->moves == mesh.moves() && data->solid.has_value() == (hull != nullptr) &&
                       same(data->bounds, mesh.bounds()) &&
                       (hull == nullptr || data->solid->corners.size() == hull->vertices().size());
    if (!known) {
        std::unique_ptr<SurfaceData> fresh = make(tree, hull);
        if (data != nullptr) {
            fresh->holders = data->holders;
            fresh->listed = data->listed;
        }
        data = std::move(fresh);
    }
    data->usedInFrame = frame;
    list(&tree, *data);
    return *data;
}

void ShapeMemory::list(const TriangleTree* tree, SurfaceData& data) {
    if (!std::exchange(data.listed, true)) listed_.push_back(tree);
}

void ShapeMemory::hold(const TriangleTree& tree) {
    ++surfaces_.at(&tree)->holders;
}

void ShapeMemory::release(const TriangleTree* tree) {
    SurfaceData& data = *surfaces_.at(tree);
    --data.holders;
    list(tree, data);
}

void ShapeMemory::forget(std::uint64_t before) {
    std::erase_if(listed_, [&](const TriangleTree* tree) {
        const auto at = surfaces_.find(tree);
        if (at->second->usedInFrame >= before) return false;
        at->second->listed = false;
        if (at->second->holders == 0) surfaces_.erase(at);
        return true;
    });
}

}  // namespace tessera::rigid
