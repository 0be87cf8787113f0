#include "common/geometry/TriangleOrder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "common/geometry/Mesh.h"

namespace tessera {
namespace {

using Corners = std::array<std::uint32_t, 3>;

std::vector<Corners> trianglesOf(std::span<const std::uint32_t> indices) {
    std::vector<Corners> out;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) out.push_back({indices[i], indices[i + 1], indices[i + 2]});
    return out;
}

/// Of all runs together: squared diagonals of their boxes, in areas of the mesh.
double spreadOf(const MeshData& mesh, std::size_t run) {
    double sum = 0, area = 0;
    const auto corner = [&](std::size_t i) {
        const float* p = mesh.positions.data() + 3 * std::size_t{mesh.indices[i]};
        return Vec3d(p[0], p[1], p[2]);
    };
    for (std::size_t first = 0; first < mesh.indices.size(); first += 3 * run) {
        Box box;
        for (std::size_t i = first; i < std::min(first + 3 * run, mesh.indices.size()); ++i) box.extend(corner(i));
        sum += box.size().squaredNorm();
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        area += 0.5 * (corner(i + 1) - corner(i)).cross(corner(i + 2) - corner(i)).norm();
    return sum / area;
}

TEST(SpatialOrder, KeepsAllTrianglesWithTheirCornersAsTheyWere) {
    MeshData mesh = makeTorus(1, 0.4, 60, 40);
    std::mt19937 random(3);
    std::vector<Corners> shuffled = trianglesOf(mesh.indices);
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    mesh.indices.clear();
    for (const Corners& t : shuffled) mesh.indices.insert(mesh.indices.end(), t.begin(), t.end());
    const double before = spreadOf(mesh, 64);
    const std::vector<std::uint32_t> ordered = inSpatialOrder(mesh.positions, mesh.indices);
    std::vector<Corners> was = trianglesOf(mesh.indices), is = trianglesOf(ordered);
    std::sort(was.begin(), was.end());
    std::sort(is.begin(), is.end());
    EXPECT_EQ(was, is);
    mesh.indices = ordered;
    EXPECT_EQ(inSpatialOrder(mesh.positions, mesh.indices), ordered) << "nothing is left to be done";
    EXPECT_LT(spreadOf(mesh, 64), 8);
    EXPECT_GT(before, 8 * 8);
}

TEST(SpatialOrder, OfEqualPlacesIsThatOfTheArray) {
    const std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0, 1e30f, -1e30f, 5};
    const std::vector<std::uint32_t> twice{0, 1, 2, 2, 1, 0, 1, 2, 0, 3, 3, 3};
    EXPECT_EQ(inSpatialOrder(positions, std::span(twice).first(9)),
              std::vector<std::uint32_t>(twice.begin(), twice.begin() + 9));
    EXPECT_EQ(inSpatialOrder(positions, twice).size(), 12u);
    EXPECT_TRUE(inSpatialOrder({}, {}).empty());
    EXPECT_EQ(inSpatialOrder(std::span(positions).subspan(9), std::vector<std::uint32_t>{0, 0, 0}).size(), 3u);
}

}  // namespace
}  // namespace tessera
