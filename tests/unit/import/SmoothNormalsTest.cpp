/// Normals of files that have none: beside each corner's own sum over all others, and at places where very many
/// triangles meet.
#include "server/import/reader/SmoothNormals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <span>

namespace tessera {
namespace {

Vec3d placeOf(const MeshData& mesh, std::size_t corner) {
    const float* const p = &mesh.positions[std::size_t{3} * mesh.indices[corner]];
    return {p[0], p[1], p[2]};
}
Vec3d normalAt(const MeshData& mesh, std::size_t corner) {
    const float* const n = &mesh.normals[std::size_t{3} * mesh.indices[corner]];
    return {n[0], n[1], n[2]};
}
Vec3d facetOf(const MeshData& mesh, std::size_t corner) {
    const std::size_t first = corner / 3 * 3;
    const Vec3d cross =
        (placeOf(mesh, first + 1) - placeOf(mesh, first)).cross(placeOf(mesh, first + 2) - placeOf(mesh, first));
    return cross.norm() > 0 ? Vec3d(cross.normalized()) : Vec3d(Vec3d::Zero());
}
double angleOf(const MeshData& mesh, std::size_t corner) {
    const std::size_t first = corner / 3 * 3;
    const Vec3d at = placeOf(mesh, corner), a = placeOf(mesh, first + (corner + 1) % 3) - at,
                b = placeOf(mesh, first + (corner + 2) % 3) - at;
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// As the header says it, each corner with each.
void expectAsDefined(const MeshData& mesh) {
    for (std::size_t corner = 0; corner < mesh.indices.size(); ++corner) {
        Vec3d sum = Vec3d::Zero();
        bool isDoubtful = false;  // so near to 60 degrees that rounding decides
        for (std::size_t other = 0; other < mesh.indices.size(); ++other) {
            if (placeOf(mesh, other) != placeOf(mesh, corner)) continue;
            const double cosine = facetOf(mesh, corner).dot(facetOf(mesh, other));
            isDoubtful = isDoubtful || std::abs(cosine - 0.5) < 1e-5;
            if (cosine >= 0.5) sum += angleOf(mesh, other) * facetOf(mesh, other);
        }
        if (!isDoubtful && sum.norm() > 1e-6) {
            EXPECT_GT(sum.normalized().dot(normalAt(mesh, corner)), 0.99999) << corner;
        }
    }
}

MeshData bare(MeshData mesh) {
    mesh.normals.clear();
    return mesh;
}

TEST(SmoothNormals, OfABoxAreItsSides) {
    MeshData box;
    for (const float x : {0.0f, 1.0f})
        for (const float y : {0.0f, 1.0f})
            for (const float z : {0.0f, 1.0f}) box.positions.insert(box.positions.end(), {x, y, z});
    box.indices = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                   2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
    box.texcoords.assign(16, 0.5f);
    box.colors.assign(32, 7);
    setSmoothNormals(box);
    EXPECT_EQ(box.positions.size(), 24u * 3) << "three vertices a corner";
    EXPECT_EQ(box.texcoords.size(), 24u * 2);
    EXPECT_EQ(box.colors.size(), 24u * 4);
    for (std::size_t corner = 0; corner < box.indices.size(); ++corner)
        EXPECT_NEAR(normalAt(box, corner).dot(facetOf(box, corner)), 1, 1e-6);
}

TEST(SmoothNormals, OfABallPointOutwardsAndNoVertexBecomesTwo) {
    MeshData ball = bare(makeSphere(2, 24));
    const std::size_t vertices = ball.positions.size();
    setSmoothNormals(ball);
    EXPECT_EQ(ball.positions.size(), vertices);
    for (std::size_t corner = 0; corner < ball.indices.size(); ++corner)
        EXPECT_GT(normalAt(ball, corner).dot(placeOf(ball, corner).normalized()), 0.999);
    expectAsDefined(ball);
}

TEST(SmoothNormals, AreTheSumOfWhatIsNearTheirOwn) {
    std::mt19937 random(3);
    for (int round = 0; round < 20; ++round) {
        MeshData mesh;
        for (int i = 0; i < 30; ++i) mesh.positions.push_back(static_cast<float>(random() % 5));
        for (int i = 0; i < 60; ++i) mesh.indices.push_back(random() % 10);
        setSmoothNormals(mesh);
        expectAsDefined(mesh);
        for (std::size_t corner = 0; corner < mesh.indices.size(); ++corner)
            EXPECT_NEAR(normalAt(mesh, corner).norm(), 1, 1e-5);
    }
}

/// Two cones with one tip, of a hundred thousand triangles: each with each would be ten thousand million.
TEST(SmoothNormals, OfVeryManyTrianglesInOnePlaceAreMadeInTime) {
    constexpr std::uint32_t kSides = 50'000;
    MeshData cones;
    cones.positions = {0, 0, 0};
    for (const float height : {1.0f, -1.0f})
        for (std::uint32_t side = 0; side < kSides; ++side) {
            const double angle = 2 * std::numbers::pi * side / kSides;
            cones.positions.insert(cones.positions.end(),
                                   {static_cast<float>(std::cos(angle)), height, static_cast<float>(std::sin(angle))});
        }
    for (std::uint32_t side = 0; side < kSides; ++side) {
        const std::uint32_t next = (side + 1) % kSides;
        cones.indices.insert(cones.indices.end(), {0, 1 + side, 1 + next, 0, 1 + kSides + next, 1 + kSides + side});
    }
    setSmoothNormals(cones);
    EXPECT_LT(cones.positions.size() / 3, std::size_t{2} * kSides + 400);
    for (std::size_t corner = 0; corner < cones.indices.size(); corner += 3 * 97)
        EXPECT_GT(normalAt(cones, corner).dot(facetOf(cones, corner)), 0.5) << corner;
}

}  // namespace
}  // namespace tessera
