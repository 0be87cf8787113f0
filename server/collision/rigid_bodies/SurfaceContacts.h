/// Contacts of two surfaces neither of which is convex.
#pragma once

#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/query/SurfaceTopology.h"
#include "server/collision/rigid_bodies/ContactPoint.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera::rigid {

struct SurfacePart {
    const TriangleTree* tree = nullptr;
    const SurfaceTopology* topology = nullptr;
    Affine3d world = Affine3d::Identity();
    Vec3d centre = Vec3d::Zero();  ///< of its body
};

struct SurfaceQuery {
    double margin = 0, near = 0;
    double deepest = 0;     ///< no point is said to be deeper: what is wrong about a depth must not throw bodies about
    bool centreOfB = true;  ///< open surfaces have no outside: they push towards this body's centre
};

/// Appends points. Where they cross: the curves in which they do, with the direction and depth of each region
/// (Penetration.h) where both are closed. Where they do not: the nearest points. False: the work was exhausted, nothing
/// is known.
[[nodiscard]] bool contactsOfSurfaces(const SurfacePart& a, const SurfacePart& b, const SurfaceQuery& query,
                                      QueryWork& work, std::vector<ContactPoint>& out);

}  // namespace tessera::rigid
