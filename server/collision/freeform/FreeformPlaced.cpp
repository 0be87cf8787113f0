#include "server/collision/freeform/FreeformShape.h"

namespace tessera {

/// Subdivision surfaces, NURBS and triangles are what their control points make of them, under any affine map.
Expected<FreeformShape> FreeformShape::placed(const Affine3d& map) const {
    const auto fits = [&](const Vec3d& p) { return p.cwiseAbs().maxCoeff() <= kMaxCoordinate; };
    const Error tooFar{ErrorCode::kBadInput, "a control point is not finite there, or beyond 1e50"};
    FreeformShape shape;
    if (subdivision_) {
        Subdivision& s = shape.subdivision_.emplace();
        s.topology = std::make_unique<SubdivisionTopology>(*subdivision_->topology);
        s.graph = std::make_unique<NeighbourhoodGraph>(*s.topology);
        s.faces = subdivision_->faces;
        for (const Vec3d& p : subdivision_->positions)
            if (!fits(s.positions.emplace_back(map * p))) return tl::unexpected(tooFar);
        shape.build(s.faces.size());
        return shape;
    }
    if (nurbs_) {
        Nurbs& n = shape.nurbs_.emplace(*nurbs_);
        for (NurbsPatch& patch : n.patches)
            for (Vec4d& p : patch.patch.points) {
                p.head<3>() = map.linear() * p.head<3>() + map.translation() * p.w();
                if (!fits(p.head<3>() / p.w())) return tl::unexpected(tooFar);
            }
        shape.build(n.patches.size());
        return shape;
    }
    TriangleMesh mesh = mesh_;
    std::vector<Vec3d> positions;
    for (const Vec3d p : mesh_.positions()) positions.push_back(map * p);
    if (const Expected<void> moved = mesh.move(positions); !moved) return tl::unexpected(moved.error());
    if (hull_) {
        Expected<ConvexHull> hull = ConvexHull::make(mesh);
        if (!hull) return tl::unexpected(hull.error());
        return ofHull(std::move(*hull));
    }
    return ofTriangles(std::move(mesh));
}

}  // namespace tessera
