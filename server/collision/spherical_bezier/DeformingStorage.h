/// What a DeformingSurface holds; for the queries of this folder, not for their users.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/Box.h"
#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/spherical_bezier/BoxLanes.h"

namespace tessera {

struct DeformingStorage {
    static constexpr std::size_t kGroupFaces = 64;
    /// Of a group's triangles; a byte names one.
    static constexpr std::size_t kGroupVertices = 3 * kGroupFaces;
    static_assert(kGroupVertices <= 256);

    std::vector<double> positions;       ///< xyz per vertex, as they were given
    std::vector<std::uint32_t> indices;  ///< three per triangle

    /// Of each group the faces, from groupStart[g] to groupStart[g + 1]; per face three places in the group's vertices.
    std::vector<std::uint32_t> groupStart, faces;
    std::vector<std::uint8_t> corners;
    std::vector<std::uint32_t> vertexStart, vertices;
    /// Of each vertex the groups that it is in.
    std::vector<std::uint32_t> groupsStart, groups;

    /// Own coordinates, (x - centre) · unit, in float: wrong by half a unit in the last place of the largest.
    Vec3d centre = Vec3d::Zero();
    double unit = 1;    ///< a power of two
    double radius = 0;  ///< no corner of a triangle is farther from the centre, in own coordinates
    std::vector<lanes::Point4> own;
    lanes::BoxArray boxes;   ///< of groups, in own coordinates
    lanes::BoxArray blocks;  ///< of sixteen groups
    lanes::Box4 whole;

    [[nodiscard]] std::size_t groupCount() const { return groupStart.empty() ? 0 : groupStart.size() - 1; }
    [[nodiscard]] std::size_t blockCount() const { return (groupCount() + 15) / 16; }
    [[nodiscard]] Vec3d corner(std::uint32_t face, unsigned i) const {
        const double* const p = positions.data() + std::size_t{3} * indices[std::size_t{3} * face + i];
        return {p[0], p[1], p[2]};
    }
    [[nodiscard]] Triangle triangle(std::uint32_t face) const {
        return {corner(face, 0), corner(face, 1), corner(face, 2)};
    }
};

}  // namespace tessera
