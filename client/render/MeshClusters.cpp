#include "client/render/MeshClusters.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera {

std::vector<MeshCluster> clustersOf(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    constexpr std::size_t kFewest = 4;
    const std::size_t perCluster = 3 * MeshCluster::kTriangles;
    if (indices.size() < kFewest * perCluster) return {};
    std::vector<MeshCluster> clusters;
    clusters.reserve((indices.size() + perCluster - 1) / perCluster);
    Box all;
    double sizes = 0;
    for (std::size_t first = 0; first < indices.size(); first += perCluster) {
        Box box;
        for (std::size_t i = first; i < std::min(first + perCluster, indices.size()); ++i) {
            const float* p = positions.data() + 3 * std::size_t{indices[i]};
            box.extend(Vec3d(p[0], p[1], p[2]));
        }
        all.extend(box);
        sizes += box.size().norm();
        MeshCluster cluster{box.center().cast<float>(), {}};
        // So that rounding leaves nothing outside.
        const Vec3d centre = cluster.centre.cast<double>();
        for (int axis = 0; axis < 3; ++axis) {
            const double reach = std::max(box.upper[axis] - centre[axis], centre[axis] - box.lower[axis]);
            cluster.half[axis] = std::nextafter(static_cast<float>(reach), HUGE_VALF);
        }
        clusters.push_back(cluster);
    }
    // Where each reaches through half of the mesh little would ever be left away.
    constexpr double kCompact = 0.5;
    if (sizes > kCompact * all.size().norm() * static_cast<double>(clusters.size())) return {};
    return clusters;
}

void runsInFrustum(std::span<const MeshCluster> clusters, std::uint32_t triangles, const Frustum& frustum,
                   const Affine3d& frustum_T_mesh, std::vector<TriangleRun>& runs) {
    struct Side {
        Vec3d normal, reach;
        double offset;
    };
    std::array<Side, 6> sides;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const Plane& plane = frustum.planes()[i];
        const Vec3d normal = frustum_T_mesh.linear().transpose() * plane.normal;
        sides[i] = {normal, normal.cwiseAbs(), plane.normal.dot(frustum_T_mesh.translation()) + plane.offset};
    }
    const std::size_t before = runs.size();
    for (std::size_t k = 0; k < clusters.size(); ++k) {
        const Vec3d centre = clusters[k].centre.cast<double>(), half = clusters[k].half.cast<double>();
        const bool outside = std::any_of(sides.begin(), sides.end(), [&](const Side& side) {
            // NaN is not outside.
            return side.normal.dot(centre) + side.reach.dot(half) + side.offset < 0;
        });
        if (outside) continue;
        const auto first = static_cast<std::uint32_t>(k * MeshCluster::kTriangles);
        const std::uint32_t count =
            std::min(static_cast<std::uint32_t>(MeshCluster::kTriangles), triangles - first);
        if (runs.size() > before && runs.back().first + runs.back().count == first)
            runs.back().count += count;
        else
            runs.push_back({first, count});
    }
}

}  // namespace tessera
