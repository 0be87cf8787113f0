// Parts of large meshes: what is left away has no corner in the frustum.
#include "client/render/MeshClusters.h"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/Mesh.h"
#include "common/geometry/TriangleOrder.h"
#include "tests/golden/TestScene.h"

namespace tessera {
namespace {

MeshData ring(double size) {
    MeshData mesh = makeTorus(size, 0.4 * size, 100, 60);
    mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
    return mesh;
}

TEST(MeshClusters, HoldTheirTriangles) {
    for (const double size : {1e-30, 1.0, 1e30}) {
        const MeshData mesh = ring(size);
        const std::vector<MeshCluster> clusters = clustersOf(mesh.positions, mesh.indices);
        ASSERT_EQ(clusters.size(), (mesh.indices.size() / 3 + 255) / 256);
        for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
            const MeshCluster& cluster = clusters[i / 3 / MeshCluster::kTriangles];
            for (unsigned axis = 0; axis < 3; ++axis) {
                const double apart = static_cast<double>(mesh.positions[3 * mesh.indices[i] + axis]) -
                                     static_cast<double>(cluster.centre[axis]);
                ASSERT_LE(std::abs(apart), static_cast<double>(cluster.half[axis]));
            }
        }
    }
}

TEST(MeshClusters, AreMadeWhereTheyHelp) {
    MeshData mesh = ring(1);
    EXPECT_FALSE(clustersOf(mesh.positions, mesh.indices).empty());
    EXPECT_TRUE(clustersOf(mesh.positions, std::span(mesh.indices).first(3 * 1023)).empty()) << "it is small";
    std::vector<std::uint32_t> shuffled;
    const std::size_t count = mesh.indices.size() / 3;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t corner = 0; corner < 3; ++corner)
            shuffled.push_back(mesh.indices[3 * (i * 7919 % count) + corner]);
    EXPECT_TRUE(clustersOf(mesh.positions, shuffled).empty()) << "each would be everywhere";
}

TEST(MeshClusters, LeaveAwayNothingThatTheFrustumShows) {
    const MeshData mesh = ring(1);
    const std::vector<MeshCluster> clusters = clustersOf(mesh.positions, mesh.indices);
    const auto triangles = static_cast<std::uint32_t>(mesh.indices.size() / 3);
    std::mt19937 random(9);
    std::uniform_real_distribution<double> u(-1, 1);
    std::uint64_t kept = 0, all = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const ScreenCamera camera = test::cameraOf(4000, 2000, {0.4 * u(random), 0.3 * u(random), 2});
        const PixelRect rect{.x = static_cast<int>(1500 * (1 + u(random))), .y = static_cast<int>(800 * (1 + u(random))),
                             .width = 60 + trial, .height = 40 + trial};
        const Frustum frustum = tileFrustum(camera, rect);
        Affine3d world = Affine3d::Identity();
        world.linear() = Mat3d::NullaryExpr([&] { return u(random); });
        if (trial % 7 == 0) world.linear().col(trial % 3).setZero();
        world.translation() = Vec3d(u(random), u(random), u(random) - 1.5);
        std::vector<TriangleRun> runs{{7, 1}};
        runsInFrustum(clusters, triangles, frustum, world, runs);
        ASSERT_EQ(runs.front().first, 7u) << "what was there stays";
        std::vector<bool> shown(triangles);
        std::uint32_t end = 0;
        for (std::size_t i = 1; i < runs.size(); ++i) {
            ASSERT_TRUE(i == 1 || runs[i].first > end) << "runs are apart";
            end = runs[i].first + runs[i].count;
            ASSERT_LE(end, triangles);
            for (std::uint32_t k = runs[i].first; k < end; ++k) shown[k] = true;
        }
        for (std::uint32_t k = 0; k < triangles; ++k) {
            kept += shown[k];
            ++all;
            if (shown[k]) continue;
            // By the corners, each plane: nothing of it is inside.
            bool apart = false;
            for (const Plane& plane : frustum.planes()) {
                bool behind = true;
                for (unsigned corner = 0; corner < 3; ++corner) {
                    const float* p = mesh.positions.data() + 3 * std::size_t{mesh.indices[3 * k + corner]};
                    behind = behind && plane.normal.dot(world * Vec3d(p[0], p[1], p[2])) + plane.offset < 0;
                }
                apart = apart || behind;
            }
            ASSERT_TRUE(apart) << "trial " << trial << ", triangle " << k;
        }
    }
    EXPECT_LT(kept, all / 3);
    EXPECT_GT(kept, all / 100);
}

TEST(MeshClusters, OfNumbersThatAreNoneAreShown) {
    const MeshData mesh = ring(1);
    const std::vector<MeshCluster> clusters = clustersOf(mesh.positions, mesh.indices);
    Affine3d world = Affine3d::Identity();
    world.translation().x() = std::nan("");
    std::vector<TriangleRun> runs;
    runsInFrustum(clusters, static_cast<std::uint32_t>(mesh.indices.size() / 3),
                  tileFrustum(test::cameraOf(64, 64), {0, 0, 64, 64}), world, runs);
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(runs[0].count, mesh.indices.size() / 3);
}

}  // namespace
}  // namespace tessera
