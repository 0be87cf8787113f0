#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/geometry/Mesh.h"
#include "common/geometry/MeshCopies.h"
#include "common/math/Compose.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

MeshArrays triangle() {
    const std::array<float, 9> positions{0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::array<std::uint32_t, 3> indices{0, 1, 2};
    return {.positions = Blob::of(std::span<const float>(positions)),
            .indices = Blob::of(std::span<const std::uint32_t>(indices))};
}

Blob floats(std::size_t count, float value = 0) {
    const std::vector<float> values(count, value);
    return Blob::of(std::span<const float>(values));
}

std::string refusal(const MeshArrays& arrays, const MeshLimits& limits = {}) {
    const Expected<void> ok = checkMesh(arrays, limits);
    return ok ? std::string() : ok.error().message;
}

TEST(CheckMesh, AcceptsWhatIsWhole) {
    EXPECT_EQ(refusal(triangle()), "");
    EXPECT_EQ(refusal({}), "") << "nothing at all is a mesh without triangles";
    MeshArrays full = triangle();
    full.normals = floats(9, 1);
    full.texcoords = floats(6, 0.5f);
    full.colors = Blob(Bytes(12));
    EXPECT_EQ(refusal(full), "");
}

TEST(CheckMesh, NamesTheTriangleAndVertexOutOfRange) {
    MeshArrays arrays = triangle();
    const std::array<std::uint32_t, 6> indices{0, 1, 2, 0, 3, 1};
    arrays.indices = Blob::of(std::span<const std::uint32_t>(indices));
    EXPECT_EQ(refusal(arrays), "triangle 1 names vertex 3, but there are 3 vertices");
    arrays.positions = Blob();
    EXPECT_WORDS(refusal(arrays));
}

TEST(CheckMesh, RefusesPartsOfElements) {
    MeshArrays arrays = triangle();
    arrays.positions = floats(8);
    EXPECT_WORDS(refusal(arrays));
    arrays = triangle();
    arrays.indices = Blob(Bytes(13));
    EXPECT_WORDS(refusal(arrays));
}

TEST(CheckMesh, RefusesArraysOfOtherLengths) {
    for (Blob MeshArrays::*member : {&MeshArrays::normals, &MeshArrays::texcoords, &MeshArrays::colors}) {
        MeshArrays arrays = triangle();
        arrays.*member = Blob(Bytes(24 * 4));
        EXPECT_WORDS(refusal(arrays));
    }
}

TEST(CheckMesh, RefusesNumbersThatAreNotFinite) {
    for (const float bad : {std::nanf(""), INFINITY, -INFINITY}) {
        MeshArrays arrays = triangle();
        std::array<float, 9> positions{0, 0, 0, 1, bad, 0, 0, 1, 0};
        arrays.positions = Blob::of(std::span<const float>(positions));
        EXPECT_EQ(refusal(arrays), "the positions of vertex 1 are not finite");
        arrays = triangle();
        arrays.normals = floats(9, bad);
        EXPECT_WORDS(refusal(arrays));
    }
}

TEST(CheckMesh, RefusesAbsentBlobs) {
    MeshArrays arrays = triangle();
    arrays.positions = Blob::absent(arrays.positions.id(), arrays.positions.sizeBytes());
    EXPECT_WORDS(refusal(arrays));
    arrays = triangle();
    arrays.colors = Blob::absent({1, 2}, 12);
    EXPECT_WORDS(refusal(arrays));
}

TEST(CheckMesh, RefusesMoreThanItsLimits) {
    const Expected<void> vertices = checkMesh(triangle(), {.maxVertices = 2, .maxTriangles = 9});
    ASSERT_FALSE(vertices);
    EXPECT_EQ(vertices.error().code, ErrorCode::kLimit);
    const Expected<void> triangles = checkMesh(triangle(), {.maxVertices = 9, .maxTriangles = 0});
    ASSERT_FALSE(triangles);
    EXPECT_EQ(triangles.error().code, ErrorCode::kLimit);
}

TEST(CheckMesh, RefusesArraysThatAreNotThoseOfTheirKind) {
    const std::vector<float> positions(18), pairs(12);
    const std::vector<std::uint32_t> corners{0, 1, 2}, ends{0, 1, 2, 3, 4, 5};
    const std::vector<MeshCopy> copies(2);
    const MeshArrays bare{.positions = Blob::of(std::span<const float>(positions))};
    const auto of = [&](MeshKind kind) {
        MeshArrays arrays = bare;
        arrays.kind = kind;
        return arrays;
    };
    const auto withTriangles = [&](MeshArrays arrays) {
        arrays.indices = Blob::of(std::span<const std::uint32_t>(corners));
        return arrays;
    };
    const auto withLines = [&](MeshArrays arrays) {
        arrays.lines = Blob::of(std::span<const std::uint32_t>(ends));
        return arrays;
    };
    const auto withCopies = [&](MeshArrays arrays) {
        arrays.copies = Blob::of(std::span<const MeshCopy>(copies));
        return arrays;
    };
    const auto withTexcoords = [&](MeshArrays arrays, bool both = false) {
        arrays.texcoords = Blob::of(std::span<const float>(pairs));
        if (both) arrays.texcoords1 = arrays.texcoords;
        return arrays;
    };
    const auto withRadius = [](MeshArrays arrays, double radius) {
        arrays.pointRadius = radius;
        return arrays;
    };
    const auto sorted = [](MeshArrays arrays) {
        arrays.sorted = true;
        return arrays;
    };
    using enum MeshKind;
    const std::vector<MeshArrays> whole = {
        withTexcoords(withTriangles(of(kTriangles)), true),
        withRadius(of(kPoints), 0.5),
        withLines(of(kLines)),
        sorted(withRadius(withTexcoords(of(kDiscs)), 0.5)),
        sorted(withLines(withTexcoords(of(kStreaks)))),
        withRadius(withTexcoords(of(kSprites), true), 0.5),
        withTriangles(of(kMarched)),
        withTexcoords(withTriangles(of(kSlices))),
        withCopies(withTriangles(of(kGlyphs))),
    };
    ASSERT_EQ(whole.size(), kMeshKinds);
    for (std::size_t i = 0; i < kMeshKinds; ++i) {
        EXPECT_EQ(static_cast<std::size_t>(whole[i].kind), i);
        const Expected<void> sound = checkMesh(whole[i]);
        EXPECT_TRUE(sound) << i << ": " << sound.error().message;
    }
    // An array of no element is none.
    MeshArrays points = of(kPoints), discs = of(kDiscs);
    points.indices = points.lines = points.copies = Blob::of(std::span<const std::uint32_t>());
    EXPECT_TRUE(checkMesh(points));
    discs.texcoords = Blob::of(std::span<const float>());
    EXPECT_FALSE(checkMesh(discs));
    struct Refused {
        MeshArrays arrays;
        const char* why;
    };
    for (const auto& [arrays, why] : {
             Refused{withLines(of(kTriangles)), "triangles have no line indices: leave the array out"},
             Refused{withCopies(withTriangles(of(kTriangles))), "triangles have no copies: leave the array out"},
             Refused{withRadius(of(kTriangles), 1), "triangles have no radius: it is 1"},
             Refused{withRadius(of(kLines), 0.5), "lines have no radius: it is 0.5"},
             Refused{sorted(of(kPoints)), "only particles are sorted, not points"},
             Refused{withTriangles(of(kPoints)), "points have no triangle indices: leave the array out"},
             Refused{of(kDiscs), "discs need texture coordinates"},
             Refused{withTexcoords(of(kDiscs), true), "discs have no second texture coordinates: leave the array out"},
             Refused{withTexcoords(of(kStreaks)), "streaks need line indices"},
             Refused{withTexcoords(of(kSprites)), "sprites need second texture coordinates"},
             Refused{withRadius(withTexcoords(of(kDiscs)), -1),
                     "the discs' radius is -1: it has to be from 0 to 1e+12"},
             Refused{of(kMarched), "volumes' boxes need triangle indices"},
             Refused{withTriangles(of(kSlices)), "volumes' slices need texture coordinates"},
             Refused{withTriangles(of(kGlyphs)), "glyphs need copies"},
             Refused{of(static_cast<MeshKind>(kMeshKinds)), "there is no kind 9 of mesh"},
         }) {
        const Expected<void> sound = checkMesh(arrays);
        ASSERT_FALSE(sound) << why;
        EXPECT_EQ(sound.error().message, why);
    }
    MeshArrays odd = withLines(withTexcoords(of(kStreaks)));
    odd.lines = Blob::of(std::span<const std::uint32_t>(ends).first(4));
    EXPECT_EQ(checkMesh(odd).error().message, "2 streaks of 6 vertices: they have two each");
}

TEST(BoundsOf, HoldsEveryVertex) {
    const std::array<float, 9> positions{1, -2, 3, -4, 5, 6, 0, 0, -7};
    const Box box = boundsOf(positions);
    EXPECT_EQ(box.lower, Vec3d(-4, -2, -7));
    EXPECT_EQ(box.upper, Vec3d(1, 5, 6));
    EXPECT_TRUE(boundsOf({}).empty());
}

TEST(MeshData, AppendPlacesVerticesAndNormals) {
    MeshData mesh = makeBox({2, 2, 2});
    MeshData all;
    all.append(mesh, Affine3d::Identity());
    const Affine3d place = composeTransform({10, 0, 0}, Quatd(Eigen::AngleAxisd(0.3, Vec3d::UnitZ())), {1, 4, 1});
    all.append(mesh, place);
    ASSERT_EQ(all.positions.size(), 2 * mesh.positions.size());
    ASSERT_EQ(all.indices.size(), 2 * mesh.indices.size());
    EXPECT_EQ(refusal(all.toArrays()), "");
    // Each normal of the placed half is at right angles to its triangle's edges and has unit length.
    for (std::size_t i = mesh.indices.size(); i < all.indices.size(); i += 3) {
        const auto vertex = [&](const std::vector<float>& array, std::size_t k) {
            const std::size_t v = all.indices[i + k];
            return Vec3d(array[3 * v], array[3 * v + 1], array[3 * v + 2]);
        };
        const Vec3d edge1 = vertex(all.positions, 1) - vertex(all.positions, 0),
                    edge2 = vertex(all.positions, 2) - vertex(all.positions, 0);
        const Vec3d normal = vertex(all.normals, 0);
        EXPECT_NEAR(normal.norm(), 1, 1e-6);
        EXPECT_GT(edge1.cross(edge2).normalized().dot(normal), 0.99999);
    }
}

TEST(MeshData, AppendKeepsTrianglesFacingOutwardsInAMirror) {
    MeshData mirrored;
    mirrored.append(makeBox({2, 2, 2}), composeTransform(Vec3d::Zero(), Quatd::Identity(), {-1, 1, 1}));
    for (std::size_t i = 0; i < mirrored.indices.size(); i += 3) {
        const auto vertex = [&](const std::vector<float>& array, std::size_t k) {
            const std::size_t v = mirrored.indices[i + k];
            return Vec3d(array[3 * v], array[3 * v + 1], array[3 * v + 2]);
        };
        const Vec3d a = vertex(mirrored.positions, 0);
        const Vec3d normal = (vertex(mirrored.positions, 1) - a).cross(vertex(mirrored.positions, 2) - a);
        EXPECT_GT(normal.dot(a), 0) << "away from the middle";
        EXPECT_GT(vertex(mirrored.normals, 0).dot(a), 0);
    }
}

TEST(MeshData, AppendMakesUpWhatOnlyOneSideHas) {
    MeshData plain;
    plain.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    plain.indices = {0, 1, 2};
    MeshData colored = plain;
    colored.colors.assign(12, 7);
    colored.texcoords.assign(6, 0.5f);
    for (const auto& [first, second] :
         {std::pair{plain, colored}, {colored, plain}, {makeBox({1, 1, 1}), colored}, {colored, makeBox({1, 1, 1})}}) {
        MeshData all;
        all.append(first, Affine3d::Identity());
        all.append(second, Affine3d::Identity());
        EXPECT_EQ(refusal(all.toArrays()), "");
        EXPECT_FALSE(all.colors.empty());
        EXPECT_FALSE(all.texcoords.empty());
        EXPECT_EQ(all.normals.empty(), first.normals.empty() && second.normals.empty());
    }
}

TEST(ComputeNormals, WeighsByArea) {
    MeshData mesh;
    // Two triangles share vertex 0: one of area 2 facing +Z, one of area 0.5 facing +X.
    mesh.positions = {0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 1, 0, 0, 0, 1};
    mesh.indices = {0, 1, 2, 0, 3, 4};
    computeNormals(mesh);
    const Vec3d expected = Vec3d(1, 0, 4).normalized();
    EXPECT_LT((Vec3d(mesh.normals[0], mesh.normals[1], mesh.normals[2]) - expected).norm(), 1e-6);
    EXPECT_FLOAT_EQ(mesh.normals[5], 1) << "vertex 1 belongs to the first alone";
}

TEST(ComputeNormals, GivesUnitVectorsToDegenerateTrianglesToo) {
    MeshData mesh;
    mesh.positions = {0, 0, 0, 1, 0, 0, 2, 0, 0, 9, 9, 9};
    mesh.indices = {0, 1, 2};
    computeNormals(mesh);
    for (std::size_t v = 0; v < 4; ++v) {
        EXPECT_FLOAT_EQ(Vec3f(mesh.normals[3 * v], mesh.normals[3 * v + 1], mesh.normals[3 * v + 2]).norm(), 1);
    }
}

}  // namespace
}  // namespace tessera
