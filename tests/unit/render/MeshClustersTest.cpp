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

/// By triangle, whether it is in one of the runs after the first; they must be ascending and apart.
std::vector<bool> inRuns(const std::vector<TriangleRun>& runs, std::size_t triangles) {
    std::vector<bool> shown(triangles);
    std::uint32_t end = 0;
    for (std::size_t i = 1; i < runs.size(); ++i) {
        EXPECT_TRUE(i == 1 || runs[i].first > end) << "runs are apart";
        end = runs[i].first + runs[i].count;
        EXPECT_LE(end, triangles);
        for (std::uint32_t k = runs[i].first; k < std::min<std::size_t>(end, triangles); ++k) shown[k] = true;
    }
    return shown;
}

Vec3d cornerOf(const MeshData& mesh, std::size_t triangle, std::size_t corner) {
    const float* p = mesh.positions.data() + 3 * std::size_t{mesh.indices[3 * triangle + corner]};
    return {p[0], p[1], p[2]};
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
        const PixelRect rect{.x = static_cast<int>(1500 * (1 + u(random))),
                             .y = static_cast<int>(800 * (1 + u(random))),
                             .width = 60 + trial,
                             .height = 40 + trial};
        Affine3d world = Affine3d::Identity();
        world.linear() = Mat3d::NullaryExpr([&] { return u(random); });
        if (trial % 7 == 0) world.linear().col(trial % 3).setZero();
        world.translation() = Vec3d(u(random), u(random), u(random) - 1.5);
        std::vector<TriangleRun> runs{{7, 1}};
        ClusterSight(camera, rect, rect)
            .appendRuns({.clusters = clusters, .triangles = triangles, .backFacesShown = true}, world, runs);
        ASSERT_EQ(runs.front().first, 7u) << "what was there stays";
        const std::vector<bool> shown = inRuns(runs, triangles);
        const Frustum frustum = tileFrustum(camera, rect);
        for (std::uint32_t k = 0; k < triangles; ++k) {
            kept += shown[k];
            ++all;
            if (shown[k]) continue;
            // By the corners, each plane: nothing of it is inside.
            bool apart = false;
            for (const Plane& plane : frustum.planes()) {
                bool behind = true;
                for (std::size_t corner = 0; corner < 3; ++corner)
                    behind = behind && plane.normal.dot(world * cornerOf(mesh, k, corner)) + plane.offset < 0;
                apart = apart || behind;
            }
            ASSERT_TRUE(apart) << "trial " << trial << ", triangle " << k;
        }
    }
    EXPECT_LT(kept, all / 3);
    EXPECT_GT(kept, all / 100);
}

/// A ball with dents of so many percent: the finer it is, the flatter some of its triangles.
MeshData dented(std::mt19937& random, double percent) {
    std::uniform_real_distribution<double> u(-1, 1);
    MeshData mesh = makeSphere(1, 100);
    for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
        const auto scale = static_cast<float>(1 + 0.01 * percent * u(random));
        for (std::size_t axis = 0; axis < 3; ++axis) mesh.positions[i + axis] *= scale;
    }
    mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
    return mesh;
}

TEST(MeshClusters, TurnedAwayShowTheirBacksWhateverRoundingDoes) {
    std::mt19937 random(10);
    std::uniform_real_distribution<double> u(-1, 1);
    std::uint64_t left = 0, backs = 0;
    for (int trial = 0; trial < 400; ++trial) {
        const MeshData mesh = dented(random, trial % 4 == 0 ? 0 : trial % 4);
        const std::vector<MeshCluster> clusters = clustersOf(mesh.positions, mesh.indices);
        ASSERT_FALSE(clusters.empty());
        const auto triangles = static_cast<std::uint32_t>(mesh.indices.size() / 3);
        const ScreenCamera camera = test::cameraOf(1920, 1080, {0.4 * u(random), 0.3 * u(random), 2});
        const PixelRect rect{.x = 0, .y = 0, .width = 1920, .height = 1080};
        Affine3d world = Affine3d::Identity();
        const double size = std::pow(10, 2 * u(random));
        world.linear() = size * Quatd(u(random), u(random), u(random), u(random)).normalized().toRotationMatrix();
        // Stretched, sheared, mirrored.
        if (trial % 3 == 1) world.linear() *= Mat3d(Vec3d(u(random), u(random), u(random)).asDiagonal());
        if (trial % 3 == 2) world.linear() = size * Mat3d::NullaryExpr([&] { return u(random); });
        world.translation() = Vec3d(u(random), u(random), -size * (1.1 + 8 * std::abs(u(random))));
        const double reach = world.translation().norm() + 2 * world.linear().norm();
        std::vector<TriangleRun> both{{7, 1}}, front{{7, 1}};
        const ClusterSight sight(camera, rect, rect);
        sight.appendRuns({.clusters = clusters, .triangles = triangles, .backFacesShown = true, .reach = reach}, world,
                         both);
        sight.appendRuns({.clusters = clusters, .triangles = triangles, .reach = reach}, world, front);
        const std::vector<bool> inSight = inRuns(both, triangles), shown = inRuns(front, triangles);
        const TileProjection projection(camera, rect);
        const Mat4d clip_T_mesh = projection.clip_T_world() * world.matrix();
        const bool mirrored = world.linear().determinant() < 0;
        for (std::uint32_t k = 0; k < triangles; ++k) {
            ASSERT_TRUE(!shown[k] || inSight[k]);
            if (!inSight[k]) continue;
            std::array<Eigen::Vector2d, 3> p;
            double nearest = HUGE_VAL;
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const Vec4d clip = clip_T_mesh * cornerOf(mesh, k, corner).homogeneous();
                p[corner] = {projection.xPx(clip.x(), clip.w()), projection.yPx(clip.y(), clip.w())};
                nearest = std::min(nearest, clip.w());
            }
            if (!(nearest > 0)) {
                ASSERT_TRUE(shown[k]) << "trial " << trial;
                continue;
            }
            const Eigen::Vector2d a = p[1] - p[0], b = p[2] - p[0];
            const double area = (a.x() * b.y() - a.y() * b.x()) * (mirrored ? -1 : 1);
            backs += area < 0;
            if (shown[k]) continue;
            ++left;
            const double height = -area / std::max({a.norm(), b.norm(), (a - b).norm()});
            // Half a step of the grid on each axis, and what single precision does, at all three corners.
            const double displaced = std::sqrt(2) * (0.5 / 256 + projection.noise(reach, world.translation()) *
                                                                     projection.pixelsPerMetre() / nearest);
            ASSERT_GT(height, 2 * displaced) << "trial " << trial << ", triangle " << k;
            for (const Eigen::Vector2d& corner : p)
                ASSERT_TRUE(corner.x() > 0 && corner.x() < 1920 && corner.y() > 0 && corner.y() < 1080) << "is cut";
        }
    }
    // Dents as high as a triangle is long leave little; a smooth ball alone loses more than a third.
    EXPECT_GT(left, backs / 20) << "of " << backs << " that show their backs";
}

TEST(MeshClusters, WithATriangleThatHasNoAreaAreNotTurnedAway) {
    MeshData mesh = ring(1);
    const std::vector<MeshCluster> before = clustersOf(mesh.positions, mesh.indices);
    std::size_t changed = 0;
    for (std::size_t k = 0; k < before.size(); k += 2) {
        const std::size_t first = 3 * k * MeshCluster::kTriangles;
        mesh.indices[first] = mesh.indices[first + 1];
        changed += before[k].altitude > 0;
    }
    EXPECT_GT(changed, before.size() / 4);
    const std::vector<MeshCluster> after = clustersOf(mesh.positions, mesh.indices);
    for (std::size_t k = 0; k < before.size(); ++k) {
        if (k % 2)
            EXPECT_EQ(after[k].altitude, before[k].altitude);
        else
            EXPECT_EQ(after[k].altitude, 0.0f);
    }
}

TEST(MeshClusters, ThatAreHiddenAreLeftAway) {
    const MeshData mesh = ring(1);
    const std::vector<MeshCluster> clusters = clustersOf(mesh.positions, mesh.indices);
    ASSERT_GT(clusters.size(), 3u);
    const std::vector<std::uint64_t> hidden{0b101};
    std::vector<TriangleRun> runs;
    const PixelRect rect{0, 0, 640, 360};
    ClusterSight(test::cameraOf(640, 360, {0, 0, 2}), rect, rect)
        .appendRuns({.clusters = std::span(clusters).first(4),
                     .triangles = 4 * static_cast<std::uint32_t>(MeshCluster::kTriangles),
                     .hidden = hidden,
                     .backFacesShown = true},
                    Affine3d(Eigen::Translation3d(0, 0, -9)), runs);
    ASSERT_EQ(runs.size(), 2u);
    EXPECT_EQ(runs[0].first, MeshCluster::kTriangles);
    EXPECT_EQ(runs[0].count, MeshCluster::kTriangles);
    EXPECT_EQ(runs[1].first, 3 * MeshCluster::kTriangles);
    EXPECT_EQ(runs[1].count, MeshCluster::kTriangles);
}

TEST(MeshClusters, OfNumbersThatAreNoneAreShown) {
    const MeshData mesh = ring(1);
    const std::vector<MeshCluster> clusters = clustersOf(mesh.positions, mesh.indices);
    Affine3d world = Affine3d::Identity();
    world.translation().x() = std::nan("");
    std::vector<TriangleRun> runs;
    ClusterSight(test::cameraOf(64, 64), {0, 0, 64, 64}, {0, 0, 64, 64})
        .appendRuns({.clusters = clusters, .triangles = static_cast<std::uint32_t>(mesh.indices.size() / 3)}, world,
                    runs);
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(runs[0].count, mesh.indices.size() / 3);
}

}  // namespace
}  // namespace tessera
