/// Arrays with the tangents that a normal map asks for: those that a mesh has, else MikkTSpace's
/// (common/geometry/TangentSpace.h). Made once a process, by content, for whoever draws; collision and picks never ask.
#pragma once

#include "common/cores/Image.h"
#include "common/geometry/Mesh.h"

namespace tessera {

/// The mesh as it is drawn with this normal map. Its triangles keep their order. Where corners of one vertex have
/// different tangents, further vertices stand behind its own, and indices name them. A vertex without a tangent has
/// zeros: the image gives no direction there. Without tangents: points, lines, and triangles that have no normals or no
/// texture coordinates for this image, or an array that is not here or not sound.
///
/// Tangents of a mesh's own follow its texture coordinates, whatever the image turns (KHR_texture_transform), as other
/// readers of glTF have it; made ones follow the image.
///
/// Any thread. Costs about 0.3 µs a triangle for each content of positions, normals, texture coordinates and indices.
/// After an edit of ranges, arrays with origins lead on where no vertices stand behind the mesh's own.
[[nodiscard]] MeshArrays withTangents(MeshArrays arrays, const Image& normalMap);

}  // namespace tessera
