/// Shapes are judged as solids: closed, facing outwards, with the volume and surface that the mathematics says.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "common/geometry/Mesh.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

Vec3d at(const std::vector<float>& array, std::uint32_t v) {
    return {array[3 * v], array[3 * v + 1], array[3 * v + 2]};
}

/// By the divergence theorem; negative for a solid that is inside out.
double volumeOf(const MeshData& mesh) {
    double six = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        six += at(mesh.positions, mesh.indices[i])
                   .dot(at(mesh.positions, mesh.indices[i + 1]).cross(at(mesh.positions, mesh.indices[i + 2])));
    }
    return six / 6;
}

/// Every edge is passed as often in one direction as in the other, where vertices at one place count as one.
bool closed(const MeshData& mesh) {
    using Place = std::tuple<long, long, long>;
    const auto place = [&](std::uint32_t v) {
        const Vec3d p = at(mesh.positions, v) * 1e5;
        return Place(std::lround(p.x()), std::lround(p.y()), std::lround(p.z()));
    };
    std::map<std::pair<Place, Place>, int> edges;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Place a = place(mesh.indices[i + k]), b = place(mesh.indices[i + (k + 1) % 3]);
            if (a == b) return false;  // a triangle without area
            ++edges[{a, b}];
            --edges[{b, a}];
        }
    }
    for (const auto& [edge, balance] : edges) {
        if (balance != 0) return false;
    }
    return true;
}

/// Normals of unit length, within `degrees` of the triangles' own.
bool normalsAgree(const MeshData& mesh, double degrees) {
    const double least = std::cos(degrees * kPi / 180);
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Vec3d a = at(mesh.positions, mesh.indices[i]);
        const Vec3d face = (at(mesh.positions, mesh.indices[i + 1]) - a)
                               .cross(at(mesh.positions, mesh.indices[i + 2]) - a)
                               .normalized();
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d normal = at(mesh.normals, mesh.indices[i + k]);
            if (std::abs(normal.norm() - 1) > 1e-5 || normal.dot(face) < least) return false;
        }
    }
    return true;
}

/// A prism of n sides in a circle has this share of the circle's area.
double polygonShare(int n) {
    return n * std::sin(2 * kPi / n) / (2 * kPi);
}

TEST(Shapes, BoxIsASolidOfItsSize) {
    const MeshData box = makeBox({2, 3, 4});
    EXPECT_EQ(box.indices.size(), 36u);
    EXPECT_TRUE(closed(box));
    EXPECT_TRUE(normalsAgree(box, 0.01));
    EXPECT_NEAR(volumeOf(box), 24, 1e-6);
    EXPECT_EQ(boundsOf(box.positions).lower, Vec3d(-1, -1.5, -2));
}

TEST(Shapes, CylinderIsASolidPrism) {
    const MeshData cylinder = makeCylinder(2, 5, 24);
    EXPECT_TRUE(closed(cylinder));
    EXPECT_TRUE(normalsAgree(cylinder, 180.0 / 24 + 0.1));
    EXPECT_NEAR(volumeOf(cylinder), kPi * 4 * 5 * polygonShare(24), 1e-4);
    EXPECT_NEAR(boundsOf(cylinder.positions).upper.y(), 2.5, 1e-6);
}

TEST(Shapes, TubeHasAHole) {
    const MeshData tube = makeTube(2, 1.5, 3, 32);
    EXPECT_TRUE(closed(tube));
    EXPECT_TRUE(normalsAgree(tube, 180.0 / 32 + 0.1));
    EXPECT_NEAR(volumeOf(tube), kPi * (4 - 2.25) * 3 * polygonShare(32), 1e-4);
}

TEST(Shapes, SphereComesNearTheSphere) {
    const MeshData sphere = makeSphere(2, 64);
    EXPECT_TRUE(closed(sphere));
    EXPECT_TRUE(normalsAgree(sphere, 6));
    EXPECT_NEAR(volumeOf(sphere) / (4.0 / 3 * kPi * 8), 1, 0.005);
    EXPECT_LT(volumeOf(sphere), 4.0 / 3 * kPi * 8) << "inscribed";
}

TEST(Shapes, TorusComesNearTheTorus) {
    const MeshData torus = makeTorus(3, 0.5, 64, 32);
    EXPECT_TRUE(closed(torus));
    EXPECT_TRUE(normalsAgree(torus, 8));
    EXPECT_NEAR(volumeOf(torus) / (2 * kPi * kPi * 3 * 0.25), 1, 0.01);
    EXPECT_NEAR(boundsOf(torus.positions).upper.y(), 0.5, 1e-6);
}

TEST(Shapes, PipeIsMitredAtItsBends) {
    // Two straight legs meeting at right angles: the volume is the cross-section times the length of the centre line.
    const std::vector<Vec3d> path{{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {4, 3, 5}};
    const MeshData pipe = makePipe(path, 0.2, 24);
    EXPECT_TRUE(closed(pipe));
    EXPECT_TRUE(normalsAgree(pipe, 180.0 / 24 + 0.1));
    EXPECT_NEAR(volumeOf(pipe), kPi * 0.04 * polygonShare(24) * 12, 1e-4);
    // The outer corner of a mitred bend reaches past both legs.
    EXPECT_NEAR(boundsOf(pipe.positions).upper.x(), 4.2, 0.01);
    EXPECT_NEAR(boundsOf(pipe.positions).lower.y(), -0.2, 0.01);
}

TEST(Shapes, PipeLeavesOutRepeatedPointsAndSurvivesTurningBack) {
    EXPECT_TRUE(makePipe({}, 1, 8).indices.empty());
    const std::vector<Vec3d> point{{1, 1, 1}, {1, 1, 1}};
    EXPECT_TRUE(makePipe(point, 1, 8).indices.empty());
    const std::vector<Vec3d> repeated{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {3, 0, 0}};
    EXPECT_NEAR(volumeOf(makePipe(repeated, 0.1, 16)), kPi * 0.01 * polygonShare(16) * 3, 1e-5);
    const std::vector<Vec3d> back{{0, 0, 0}, {5, 0, 0}, {1, 0.0001, 0}};
    const Box bounds = boundsOf(makePipe(back, 0.1, 16).positions);
    EXPECT_LT(bounds.upper.x(), 5.3);
}

TEST(Shapes, FewSegmentsStillMakeSolids) {
    for (const int segments : {-1, 0, 1, 3}) {
        EXPECT_TRUE(closed(makeCylinder(1, 1, segments)));
        EXPECT_TRUE(closed(makeSphere(1, segments)));
        EXPECT_TRUE(closed(makeTorus(2, 1, segments, segments)));
        EXPECT_GT(volumeOf(makeTube(2, 1, 1, segments)), 0);
    }
}

TEST(Shapes, PassTheirOwnCheck) {
    const std::vector<Vec3d> path{{0, 0, 0}, {1, 1, 0}, {2, 0, 1}};
    for (const MeshData& mesh : {makeBox({1, 1, 1}), makeCylinder(1, 1, 9), makeTube(2, 1, 1, 9), makeSphere(1, 9),
                                 makeTorus(2, 1, 9, 9), makePipe(path, 0.1, 9)}) {
        const Expected<void> ok = checkMesh(mesh.toArrays());
        EXPECT_TRUE(ok) << ok.error().message;
        EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
    }
}

}  // namespace
}  // namespace tessera
