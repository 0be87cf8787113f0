/// What is drawn, in world coordinates, for formats that know no nodes.
#pragma once

#include <vector>

#include "common/cores/Material.h"
#include "common/export/Formats.h"
#include "common/geometry/Mesh.h"

namespace tessera {

struct WorldMesh {
    const SelectedNode* node = nullptr;
    MeshArrays arrays;  ///< in the node's own coordinates: triangles, lines or points; glyphs are triangles
    ObjectId material;

    [[nodiscard]] std::size_t vertices() const { return arrays.positions.sizeBytes() / (3 * sizeof(float)); }
    [[nodiscard]] std::size_t triangles() const { return arrays.indices.sizeBytes() / (3 * sizeof(std::uint32_t)); }
    /// Turned triangles face the other way: their second and third corners change places.
    [[nodiscard]] bool mirrors() const { return node->world_T_node.linear().determinant() < 0; }
    [[nodiscard]] Vec3f position(std::size_t vertex) const;
    /// Of length 1; only where there are normals.
    [[nodiscard]] Vec3f normal(std::size_t vertex) const;
    /// The three of a triangle, counter-clockwise seen from outside.
    [[nodiscard]] std::array<std::uint32_t, 3> corners(std::size_t triangle) const;

private:
    friend Expected<std::vector<WorldMesh>> worldMeshes(const LeavingScene& leaving);
    Mat3d normals_ = Mat3d::Identity();  ///< world_T_node's cofactors
};

/// In the order of the document. Particles are left out, with a note, and so is what single precision cannot say.
[[nodiscard]] Expected<std::vector<WorldMesh>> worldMeshes(const LeavingScene& leaving);

/// The normal of a triangle, of length 1; 0 where it has no area.
[[nodiscard]] Vec3f faceNormal(const Vec3f& a, const Vec3f& b, const Vec3f& c);

/// The Material, or the default one.
[[nodiscard]] Material materialOf(const Aspect& scene, ObjectId id);
/// A base colour as bytes, sRGB with alpha.
[[nodiscard]] std::array<std::uint8_t, 4> colorBytes(const Vec4f& linear);

}  // namespace tessera
