/// Contacts of a convex solid with triangles of a surface.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/query/SurfaceTopology.h"
#include "server/collision/rigid_bodies/ContactPoint.h"
#include "server/collision/rigid_bodies/SolidContacts.h"

namespace tessera::rigid {

/// A surface in place.
struct PlacedSurface {
    const TriangleMesh* mesh = nullptr;
    const SurfaceTopology* topology = nullptr;
    Affine3d world = Affine3d::Identity();
};

/// What the answer depends on beside the bodies.
struct FaceQuery {
    double margin = 0;  ///< gaps up to this are wanted
    /// Of these those only that `approach` may close, or this much more of motion in whatever direction.
    double slack = 0;
    double fine = 0;                 ///< differences in gap that do not matter
    double near = 0;                 ///< points as near to each other count as one
    Vec3d approach = Vec3d::Zero();  ///< of the solid, seen from the surface, within the frame
    bool solidIsA = true;
};

/// Appends points. Triangles have two sides; the one on which the solid's centre lies counts. Where triangles go on
/// smoothly across an edge, the edge itself is no obstacle; a ridge is one for directions between its faces' normals.
/// Triangles without area meet nothing. `within`: appended are the triangles within reach, whether they gave points or
/// not; all others are parted by more than the lesser of margin and slack.
void contactsWithFaces(const PlacedSolid& solid, const PlacedSurface& surface, std::span<const std::uint32_t> faces,
                       const FaceQuery& query, ClipScratch& scratch, std::vector<NearFace>& within,
                       std::vector<ContactPoint>& out);

}  // namespace tessera::rigid
