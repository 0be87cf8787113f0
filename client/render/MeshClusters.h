/// Large meshes in parts that are culled by themselves.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "client/render/TileProjection.h"
#include "common/math/Frustum.h"

namespace tessera {

/// A run of a mesh's triangles, in the order of its indices: a box around them, and a cone of directions that their
/// normals lie in. In the mesh's own coordinates.
struct MeshCluster {
    static constexpr std::size_t kTriangles = 256;  ///< in each but the last
    Vec3f centre, half;
    // Normals are within this angle of the axis, which has length 1 but for rounding.
    Vec3f axis = Vec3f::Zero();
    float cosine = -1, sine = 0;  ///< of the angle; below 90 degrees, or nothing is known
    float altitude = 0;           ///< no triangle is lower; 0: one has no area, or nothing is known

    [[nodiscard]] Box box() const {
        return {centre.cast<double>() - half.cast<double>(), centre.cast<double>() + half.cast<double>()};
    }
};

/// Empty for a mesh that is small, or whose order makes no compact parts. The mesh has passed checkMesh.
[[nodiscard]] std::vector<MeshCluster> clustersOf(std::span<const float> positions,
                                                  std::span<const std::uint32_t> indices);

struct TriangleRun {
    std::uint32_t first = 0, count = 0;
    bool operator==(const TriangleRun&) const = default;
};

/// One bit per cluster; empty: none is.
using ClusterBits = std::span<const std::uint64_t>;
[[nodiscard]] inline bool hasBit(ClusterBits bits, std::size_t cluster) {
    return !bits.empty() && (bits[cluster / 64] >> cluster % 64 & 1) != 0;
}
[[nodiscard]] constexpr std::size_t wordsFor(std::size_t clusters) {
    return (clusters + 63) / 64;
}

/// What a rectangle of a screen can show of large meshes: not what lies beside it, nor what turns its back.
///
/// Turned away are clusters that show their back faces alone, and surely so: each triangle is so high on the screen
/// that a grid of 1/256 pixel and single precision turn none over; and no edge of the screen cuts any, which would make
/// new, flatter triangles of them. The cone is that of Shirman and Abi-Ezzi (1993), the height our own.
class ClusterSight {
public:
    /// `uncut`: the pixels that are drawn at once: a rasteriser cuts triangles at their border.
    ClusterSight(const ScreenCamera& screen, const PixelRect& shown, const PixelRect& uncut);

    struct Mesh {
        std::span<const MeshCluster> clusters;
        std::uint32_t triangles = 0;
        ClusterBits hidden = {};  ///< to be left away, too
        bool backFacesShown = false;
        double reach = 0;  ///< no vertex is farther from the mesh's origin, in world units
    };
    /// Appends the runs of triangles of which something may be seen, ascending and apart.
    void appendRuns(const Mesh& mesh, const Affine3d& world_T_mesh, std::vector<TriangleRun>& runs) const;

private:
    struct Side {
        Vec3d normal, reach;
        double offset;
        [[nodiscard]] double least(const Vec3d& centre, const Vec3d& half) const {
            return normal.dot(centre) - reach.dot(half) + offset;
        }
        [[nodiscard]] double most(const Vec3d& centre, const Vec3d& half) const {
            return normal.dot(centre) + reach.dot(half) + offset;
        }
    };
    /// Of one mesh: the eye in its coordinates, and what a length there is on the screen.
    struct Facing {
        Vec3d eye;
        Side depth;        ///< metres before the eye
        double scale = 0;  ///< pixels, see `turnedAway`
        double noise = 0;
    };
    using Sides = std::array<Side, 6>;
    [[nodiscard]] static Sides sidesOf(const Frustum& frustum, const Affine3d& world_T_mesh);
    [[nodiscard]] std::optional<Facing> facing(const Mesh& mesh, const Affine3d& world_T_mesh) const;
    [[nodiscard]] bool turnedAway(const MeshCluster& cluster, const Vec3d& centre, const Vec3d& half,
                                  const Facing& facing) const;

    Frustum shown_, uncut_;
    TileProjection projection_;
    Affine3d eye_T_world_;
};

}  // namespace tessera
