/// What queries need of one geometry.
#pragma once

#include <optional>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// Read by any number of threads; changed (a deformation) by the object handler alone.
struct CollisionShape {
    /// Of the triangles as they are; for a hull: of the hull's own faces, so that all queries about surfaces work on
    /// it.
    TriangleTree tree;
    /// Solid: what is inside it touches it too.
    std::optional<ConvexHull> hull;
    /// For a hull: a ball that holds it. However the hull is turned, its box is no larger than the ball's.
    Vec3d ballCentre = Vec3d::Zero();
    double ballRadius = 0;
};

}  // namespace tessera
