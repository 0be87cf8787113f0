/// Normals for meshes of files that have none, with edges where faces meet at an angle.
#pragma once

#include <numbers>

#include "common/geometry/Mesh.h"

namespace tessera {

/// A corner's normal is the mean of the normals of the triangles that meet at its place and are turned less than
/// `creaseAngle` (radians) away from its own, weighed by the angles that they have there (G. Thürmer, C. Wüthrich
/// 1998): so it does not matter how polygons were cut. Vertices whose triangles disagree become several. Places are
/// equal where their coordinates are, whatever else vertices have. Of triangles alone; indices in range, positions
/// finite. A corner of triangles without area gets some unit vector. Time and memory are linear, however many triangles
/// meet in one place.
void setSmoothNormals(MeshData& mesh, double creaseAngle = std::numbers::pi / 3);

/// The unit normal of one triangle; (0, 1, 0) where it has no area.
[[nodiscard]] Vec3f facetNormal(const float* a, const float* b, const float* c);

}  // namespace tessera
