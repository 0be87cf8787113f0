/// Points, as of a scan: balls of one radius. Pictures show the balls (client/draw/shaders/glsl/PointFragment.glsl).
/// Where triangles are asked for, by rays and by what names a face of a contact, it is an octahedron each whose corners
/// lie on the ball; these are made where somebody needs them, and are in no scene and in no file.
#pragma once

#include <cstddef>
#include <span>

#include "common/geometry/Mesh.h"

namespace tessera {

inline constexpr std::size_t kVerticesPerPoint = 6, kFacesPerPoint = 8;

/// The radius that points are shown with: theirs; where that is 0, a two-thousandth of the diagonal of the box around
/// them, or of 1 where that is nothing, so that there is something to see and to pick.
[[nodiscard]] double shownRadius(double pointRadius, const Box& places);
[[nodiscard]] double shownRadius(const MeshArrays& points);
/// From the box around their centres. Empty for none.
[[nodiscard]] Box boundsOfPoints(const Box& places, double pointRadius);

/// The octahedra of the points [begin, end): the first has the vertices 0 to 5 (+X, -X, +Y, -Y, +Z, -Z) and the faces
/// 0 to 7, in the octants that count -X, -Y, -Z as 1, 2, 4. Colours and texture coordinates are the point's; normals
/// too, where points have some (a scan's surface is shaded as one), else they point outwards. The points' arrays have
/// passed checkMesh; `radius` is what `shownRadius` says of all of them.
[[nodiscard]] MeshData trianglesOfPoints(const MeshArrays& points, double radius, const ByteRange& which);
/// Of all.
[[nodiscard]] MeshData trianglesOfPoints(const MeshArrays& points);
/// The indices of the points [begin, end) among the vertices of all.
[[nodiscard]] std::vector<std::uint32_t> indicesOfPoints(const ByteRange& which);

/// How far a point is from its nearest neighbour: the median of a sample of 256, those in the same place left out. 0
/// where there are no two places. O(n log n); positions that are not finite are passed over.
[[nodiscard]] double spacingOf(std::span<const float> positions);

/// A surface of triangles as a scanner sees it: about one point, with its normal, on every spacing² of it, evenly laid
/// and in the same places each time. Without a radius. kLimit where there would be more than `maxPoints`.
[[nodiscard]] Expected<MeshData> pointsOnSurface(const MeshData& surface, double spacing,
                                                 std::size_t maxPoints = MeshLimits().maxPoints);

}  // namespace tessera
