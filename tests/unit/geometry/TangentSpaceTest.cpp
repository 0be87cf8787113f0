/// Tangents, corner by corner, beside those of the algorithm's own program; and what the text says of single cases.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "common/geometry/Mesh.h"
#include "common/geometry/TangentSpace.h"
#include "common/math/Types.h"

namespace tessera {
namespace {

using Tangent = std::array<float, 4>;

struct Flat {
    std::vector<float> positions, normals, texcoords;
    std::vector<std::uint32_t> indices;
    [[nodiscard]] std::vector<Tangent> tangents() const {
        const CornerTangents made = mikkTangents({positions, normals, texcoords, indices});
        std::vector<Tangent> corners;
        for (const std::uint32_t i : made.ofCorner) corners.push_back(made.tangents[i]);
        return corners;
    }
};

float lengthOf(const Tangent& t) {
    return std::hypot(t[0], t[1], t[2]);
}

TEST(TangentSpace, CornersHaveTheTangentsOfMikkelsensProgram) {
    std::ifstream file(TESSERA_SOURCE_DIR "/tests/data/tangents/mikktspace.txt");
    ASSERT_TRUE(file);
    std::string word;
    std::size_t meshes = 0, compared = 0, vertices = 0, triangles = 0;
    while (file >> word >> vertices >> triangles) {
        ASSERT_EQ(word, "mesh");
        SCOPED_TRACE(++meshes);
        Flat mesh;
        for (std::size_t v = 0; v < vertices; ++v)
            for (const auto& [array, count] :
                 {std::pair(&mesh.positions, 3), std::pair(&mesh.normals, 3), std::pair(&mesh.texcoords, 2)})
                for (int k = 0; k < count; ++k) file >> array->emplace_back();
        for (std::size_t c = 0; c < 3 * triangles; ++c) file >> mesh.indices.emplace_back();
        const std::vector<Tangent> made = mesh.tangents();
        ASSERT_EQ(made.size(), 3 * triangles);
        for (const Tangent& is : made) {
            Tangent should{};
            for (float& number : should) file >> number;
            if (lengthOf(is) == 0) {
                // Theirs: (1, 0, 0), or what is left of a sum of zero.
                EXPECT_TRUE(lengthOf(should) == 0 || (should[0] == 1 && should[3] == -1)) << compared;
                continue;
            }
            for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(is[k], should[k], 2e-5) << compared;
            ASSERT_EQ(is[3], -should[3]) << "v goes down here";
            ++compared;
        }
        ASSERT_TRUE(file);
    }
    EXPECT_EQ(meshes, 8u);
    EXPECT_GT(compared, 800u);
}

Flat sheet() {
    return {.positions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0},
            .normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1},
            .texcoords = {0, 1, 1, 1, 1, 0, 0, 0},
            .indices = {0, 1, 2, 0, 2, 3}};
}

TEST(TangentSpace, AnImageAsItHangsHasUAlongAndItsUpperEdgeAbove) {
    for (const Tangent& t : sheet().tangents()) EXPECT_EQ(t, (Tangent{1, 0, 0, 1}));
    Flat mirrored = sheet();
    for (std::size_t i = 0; i < mirrored.texcoords.size(); i += 2) mirrored.texcoords[i] = 1 - mirrored.texcoords[i];
    for (const Tangent& t : mirrored.tangents()) EXPECT_EQ(t, (Tangent{-1, 0, 0, -1}));
}

TEST(TangentSpace, WithoutADirectionThereIsNone) {
    Flat flat = sheet();
    flat.texcoords.assign(8, 0.5f);
    for (const Tangent& t : flat.tangents()) EXPECT_EQ(lengthOf(t), 0);
    Flat empty = sheet();
    empty.indices.clear();
    EXPECT_TRUE(empty.tangents().empty());
    // Numbers whose products no float holds.
    Flat huge = sheet();
    for (float& x : huge.positions) x *= 3e38f;
    for (const Tangent& t : huge.tangents()) EXPECT_TRUE(std::isfinite(lengthOf(t)));
}

// A hub of very many triangles, and one edge that very many share: in a time proportional to them.
TEST(TangentSpace, CostsWhatItHolds) {
    constexpr std::uint32_t kMany = 300'000;
    Flat fan{.positions = {0, 0, 0}, .normals = {0, 0, 1}, .texcoords = {0.5f, 0.5f}, .indices = {}};
    Flat book{.positions = {0, 0, 0, 0, 1, 0}, .normals = {0, 0, 1, 0, 0, 1}, .texcoords = {0, 0, 0, 1}, .indices = {}};
    for (std::uint32_t i = 0; i < kMany; ++i) {
        const float a = 6.2831853f * static_cast<float>(i) / kMany;
        for (Flat* mesh : {&fan, &book}) {
            mesh->positions.insert(mesh->positions.end(), {std::cos(a), std::sin(a), 0});
            mesh->normals.insert(mesh->normals.end(), {0, 0, 1});
        }
        fan.texcoords.insert(fan.texcoords.end(), {0.5f + 0.5f * std::cos(a), 0.5f - 0.5f * std::sin(a)});
        book.texcoords.insert(book.texcoords.end(), {static_cast<float>(i + 1), 0.5f});
        fan.indices.insert(fan.indices.end(), {0, 1 + i, 1 + (i + 1) % kMany});
        book.indices.insert(book.indices.end(), {0, 1, 2 + i});
    }
    EXPECT_NEAR(fan.tangents().front()[0], 1, 1e-3);
    EXPECT_EQ(book.tangents().size(), 3 * kMany);
}

TEST(TangentSpace, AMeshThatIsMovedTakesItsTangentsAlong) {
    MeshData mesh = makeBox({1, 2, 3});
    const MeshArrays arrays = mesh.toArrays();
    const CornerTangents made = mikkTangents({mesh.positions, mesh.normals, mesh.texcoords, mesh.indices});
    mesh.tangents.assign(mesh.positions.size() / 3 * 4, 0);
    for (std::size_t c = 0; c < mesh.indices.size(); ++c)
        std::ranges::copy(made.tangents[made.ofCorner[c]], mesh.tangents.begin() + 4 * mesh.indices[c]);
    // Mirrored, stretched and turned: what the texture coordinates say of the moved triangles is the same.
    Affine3d place = Affine3d::Identity();
    place.linear() = Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized()).toRotationMatrix() *
                     Eigen::DiagonalMatrix<double, 3>(-2.0, 1.0, 0.5);
    MeshData moved;
    moved.append(mesh, place);
    ASSERT_EQ(moved.tangents.size(), mesh.tangents.size());
    const CornerTangents again = mikkTangents({moved.positions, moved.normals, moved.texcoords, moved.indices});
    for (std::size_t c = 0; c < moved.indices.size(); ++c) {
        const Tangent& should = again.tangents[again.ofCorner[c]];
        for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(moved.tangents[4 * moved.indices[c] + k], should[k], 1e-5) << c;
    }
    MeshData both = mesh;
    both.append(makeBox({1, 1, 1}), place);
    EXPECT_TRUE(both.tangents.empty()) << "only one of the two has some";
}

}  // namespace
}  // namespace tessera
