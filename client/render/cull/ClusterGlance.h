/// Roughly where a mesh's clusters lie on a tile: for choices that touch speed alone.
#pragma once

#include <algorithm>
#include <cmath>

#include "client/render/MeshClusters.h"
#include "client/render/TileProjection.h"

namespace tessera {

/// Says nothing that anything exact may rest on; that is ClusterSight's and Footprint's part.
class ClusterGlance {
public:
    ClusterGlance(const TileProjection& tile, const Affine3d& world_T_mesh, const Mat4d& clip_T_mesh,
                  const Vec3d& eyeWorld);

    struct Place {
        bool shown = false;   ///< on the tile, and not turned away as a whole
        double facing = 0;    ///< share of its triangles that face the eye, as far as can be told
        double areaPx = 0;    ///< of the tile that it covers; 0 where it reaches the near plane
        double farthest = 0;  ///< metres
    };
    [[nodiscard]] Place at(const MeshCluster& cluster) const {
        const Vec3d centre = cluster.centre.cast<double>(), half = cluster.half.cast<double>();
        const Vec3d away = centre - eye_;
        const double along = cluster.axis.cast<double>().dot(away), squared = away.squaredNorm();
        const double across = std::sqrt(std::max(0.0, squared - along * along)) * static_cast<double>(cluster.sine);
        const double radius = half.norm();
        double facing = 0.5;
        // Where nothing is known of its normals its cosine is below 0.
        if (cluster.cosine > 0) {
            const double behind = along * static_cast<double>(cluster.cosine);
            if (behind - across > radius) return {};
            if (behind + across < -radius) facing = 1;
        }
        const Vec3d middle = rows_ * centre + offset_;
        const double deep = forward_.dot(half);
        if (middle.z() + deep <= nearest_) return {};
        if (middle.z() - deep <= nearest_)
            return {.shown = true, .facing = facing, .areaPx = 0, .farthest = middle.z() + deep};
        // Around the middle's pixel, to the first order.
        const double inverse = 1 / middle.z();
        const double x = middle.x() * inverse, y = middle.y() * inverse;
        const double reachX = (rows_.row(0) - x * rows_.row(2)).cwiseAbs().dot(half) * inverse;
        const double reachY = (rows_.row(1) - y * rows_.row(2)).cwiseAbs().dot(half) * inverse;
        const double width = std::min(widthPx_, x + reachX) - std::max(0.0, x - reachX);
        const double height = std::min(heightPx_, y + reachY) - std::max(0.0, y - reachY);
        if (!(width > 0 && height > 0)) return {};
        return {.shown = true, .facing = facing, .areaPx = kFilled * width * height, .farthest = middle.z() + deep};
    }

private:
    /// Of the rectangle around it a cluster covers about this share.
    static constexpr double kFilled = 0.5;

    Vec3d eye_;   ///< in the mesh's coordinates
    Mat3d rows_;  ///< pixels times w, and w
    Vec3d offset_;
    Vec3d forward_;  ///< of the row of w, absolute
    double widthPx_, heightPx_, nearest_;
};

}  // namespace tessera
