/// Tangents for normal maps, by MikkTSpace: what bakers of normal maps use, and what glTF 2.0 asks for where a file has
/// none.
///
/// M. S. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008, and the choices that his program makes. Corners
/// of equal position, normal and texture coordinates are one vertex, whatever the indices say. Around a vertex,
/// triangles that share an edge, and that the image covers the same way round, are a group. A group has one tangent:
/// the mean of its triangles' directions along u, in the plane of the vertex's normal, weighted by their angle there.
/// A triangle that the image gives no direction belongs to its neighbours' groups. A triangle with two corners in one
/// place takes the tangents that its corners have elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tessera {

/// Arrays that fit together: as many normals and texture coordinates as positions, indices of them, three a triangle.
struct TangentSource {
    std::span<const float> positions, normals;  ///< xyz each
    std::span<const float> texcoords;           ///< uv, as glTF has them: v goes down
    std::span<const std::uint32_t> indices;
};

/// Corners of one vertex may have different tangents: where an image is mirrored, or triangles meet in a point alone.
struct CornerTangents {
    /// Of unit length across the normal; w: 1 or -1, so that cross(normal, xyz) · w goes against v. A length of 0: the
    /// image gives no direction.
    std::vector<std::array<float, 4>> tangents;
    std::vector<std::uint32_t> ofCorner;  ///< into `tangents`, for each index
};

/// Costs a time proportional to what the arrays hold. The same bytes on every processor that rounds as IEEE says.
[[nodiscard]] CornerTangents mikkTangents(const TangentSource& mesh);

/// The same of vertices. Where corners of one have different tangents, further vertices stand behind the mesh's own.
struct VertexTangents {
    std::vector<float> tangents;         ///< xyz and w of each
    std::vector<std::uint32_t> indices;  ///< of the triangles in their order
    std::vector<std::uint32_t> copied;   ///< of each further vertex the one that it is a copy of
};
[[nodiscard]] VertexTangents mikkVertexTangents(const TangentSource& mesh);

}  // namespace tessera
