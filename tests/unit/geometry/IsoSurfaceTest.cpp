/// Surfaces of scalar fields: beside closed forms, closed whatever the field, around just what is above the value.
#include "common/geometry/IsoSurface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <random>

namespace tessera {
namespace {

/// A grid that owns its numbers.
struct OwnGrid {
    std::vector<float> numbers;
    VoxelGrid grid;

    template <typename Field>
    OwnGrid(std::array<std::size_t, 3> size, const Vec3d& origin, const Vec3d& spacing, Field&& field) {
        grid = {.format = VoxelFormat::kFloat, .size = size, .origin = origin, .spacing = spacing, .voxels = {}};
        for (std::size_t z = 0; z < size[2]; ++z)
            for (std::size_t y = 0; y < size[1]; ++y)
                for (std::size_t x = 0; x < size[0]; ++x)
                    numbers.push_back(static_cast<float>(
                        field(Vec3d(origin + spacing.cwiseProduct(Vec3d(static_cast<double>(x), static_cast<double>(y),
                                                                        static_cast<double>(z)))))));
        grid.voxels = std::as_bytes(std::span<const float>(numbers));
    }
};

Vec3d cornerAt(const MeshData& mesh, std::size_t corner) {
    const float* p = &mesh.positions[3 * std::size_t{mesh.indices[corner]}];
    return {p[0], p[1], p[2]};
}

/// Each way along an edge as often as the other; corners are told by their places.
bool isClosedSurface(const MeshData& mesh) {
    using Key = std::array<float, 3>;
    std::map<std::pair<Key, Key>, int> balance;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto key = [&](std::size_t corner) {
                const float* p = &mesh.positions[3 * std::size_t{mesh.indices[corner]}];
                return Key{p[0], p[1], p[2]};
            };
            const Key a = key(t + k), b = key(t + (k + 1) % 3);
            if (a == b) continue;
            ++balance[{a, b}];
            --balance[{b, a}];
        }
    return std::ranges::all_of(balance, [](const auto& edge) { return edge.second == 0; });
}

double enclosedVolume(const MeshData& mesh) {
    double six = 0;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
        six += cornerAt(mesh, t).dot(cornerAt(mesh, t + 1).cross(cornerAt(mesh, t + 2)));
    return six / 6;
}

/// How often the surface goes around a point (van Oosterom and Strackee 1983, "The solid angle of a plane triangle").
double windingAround(const MeshData& mesh, const Vec3d& point) {
    double sum = 0;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
        const Vec3d a = cornerAt(mesh, t) - point, b = cornerAt(mesh, t + 1) - point, c = cornerAt(mesh, t + 2) - point;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (4 * std::numbers::pi);
}

/// As IsoSurface.h takes the field: along the axes in the order of how far the point is along each.
double linearInTetrahedra(const VoxelGrid& grid, const Vec3d& steps) {
    std::array<std::size_t, 3> at{};
    std::array<std::pair<double, std::size_t>, 3> shares;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double step = steps[static_cast<Eigen::Index>(axis)];
        at[axis] = std::min(static_cast<std::size_t>(step), grid.size[axis] - 2);
        shares[axis] = {step - static_cast<double>(at[axis]), axis};
    }
    std::sort(shares.rbegin(), shares.rend());
    double value = grid.at(at[0], at[1], at[2]), sum = (1 - shares[0].first) * value;
    for (std::size_t i = 0; i < 3; ++i) {
        ++at[shares[i].second];
        sum += (shares[i].first - (i < 2 ? shares[i + 1].first : 0.0)) * grid.at(at[0], at[1], at[2]);
    }
    return sum;
}

/// A field that is the distance to a surface, above inside: linear interpolation over a simplex is off by at most three
/// eighths of the squared spacing times the field's greatest curvature (Waldron 1998, "The error in linear
/// interpolation at the vertices of a simplex").
template <typename Distance>
void expectNear(const MeshData& mesh, Distance&& distance, double spacing, double curvature) {
    ASSERT_GT(mesh.indices.size(), 3000u);
    const double bound = 3.0 / 8 * spacing * spacing * curvature + 1e-6;
    double farthest = 0;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
        const Vec3d a = cornerAt(mesh, t), b = cornerAt(mesh, t + 1), c = cornerAt(mesh, t + 2);
        for (const Vec3d& p : {a, b, c, Vec3d((a + b + c) / 3)}) farthest = std::max(farthest, std::abs(distance(p)));
    }
    EXPECT_LE(farthest, bound);
    EXPECT_GT(farthest, bound / 100) << "a bound that nothing comes near";
    EXPECT_TRUE(isClosedSurface(mesh));
}

TEST(IsoSurface, OfASphereIsASphere) {
    const double spacing = 0.1, radius = 1;
    const auto distance = [&](const Vec3d& p) { return radius - (p - Vec3d(0.01, 0.02, 0.03)).norm(); };
    const OwnGrid field({25, 26, 27}, Vec3d::Constant(-1.22), Vec3d::Constant(spacing), distance);
    const Expected<MeshData> mesh = isoSurface(field.grid, 0, 1'000'000);
    ASSERT_TRUE(mesh);
    expectNear(*mesh, distance, spacing, 1 / (radius - 2 * spacing));
    EXPECT_NEAR(enclosedVolume(*mesh), 4.0 / 3 * std::numbers::pi, 0.1);
    for (std::size_t v = 0; v < mesh->positions.size(); v += 3) {
        const Vec3d p(mesh->positions[v], mesh->positions[v + 1], mesh->positions[v + 2]),
            n(mesh->normals[v], mesh->normals[v + 1], mesh->normals[v + 2]);
        ASSERT_GT(n.dot((p - Vec3d(0.01, 0.02, 0.03)).normalized()), 0.99);
    }
}

TEST(IsoSurface, OfATorusIsATorus) {
    const double spacing = 0.06, ring = 0.7, pipe = 0.3;
    const auto distance = [&](const Vec3d& p) { return pipe - std::hypot(std::hypot(p.x(), p.y()) - ring, p.z()); };
    const OwnGrid field({39, 39, 17}, Vec3d(-1.141, -1.142, -0.481), Vec3d::Constant(spacing), distance);
    const Expected<MeshData> mesh = isoSurface(field.grid, 0, 1'000'000);
    ASSERT_TRUE(mesh);
    expectNear(*mesh, distance, spacing, 1 / (pipe - 2 * spacing));
    EXPECT_NEAR(enclosedVolume(*mesh), 2 * std::numbers::pi * std::numbers::pi * ring * pipe * pipe, 0.05);
}

TEST(IsoSurface, IsClosedByTheBoxWhereTheFieldIsAboveAtItsBorder) {
    const OwnGrid everywhere({4, 3, 5}, Vec3d(1, 2, 3), Vec3d(0.5, 1, 2), [](const Vec3d&) { return 1.0; });
    const Expected<MeshData> box = isoSurface(everywhere.grid, 0, 1000);
    ASSERT_TRUE(box);
    EXPECT_TRUE(isClosedSurface(*box));
    EXPECT_NEAR(enclosedVolume(*box), 1.5 * 2 * 8, 1e-9);
    const Expected<MeshData> nothing = isoSurface(everywhere.grid, 2, 1000);
    ASSERT_TRUE(nothing);
    EXPECT_TRUE(nothing->indices.empty());
}

TEST(IsoSurface, IsRefusedInWordsWhereItHasTooManyTriangles) {
    const OwnGrid noise({20, 20, 20}, Vec3d::Zero(), Vec3d::Ones(),
                        [](const Vec3d& p) { return std::sin(1e4 * (p.x() + 7 * p.y() + 31 * p.z())); });
    const Expected<MeshData> mesh = isoSurface(noise.grid, 0, 1000);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, ErrorCode::kLimit);
}

class IsoSurfaceOfAnything : public testing::TestWithParam<int> {};

// Fields of any format, of few values so that many are exactly the surface's, above at the border or not.
TEST_P(IsoSurfaceOfAnything, IsClosedAndAroundJustWhatIsAbove) {
    const char* given = std::getenv("TESSERA_SEED");
    const auto seed = static_cast<unsigned>((given ? std::atoi(given) : 1) * 1000 + GetParam());
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed / 1000) +
                 " build/bin/unit_geometry --gtest_filter='*IsoSurfaceOfAnything*'");
    std::mt19937 random(seed);
    const auto any = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
    VoxelGrid grid{.format = static_cast<VoxelFormat>(GetParam() % 4),
                   .size = {static_cast<std::size_t>(any(2, 5)), static_cast<std::size_t>(any(2, 5)),
                            static_cast<std::size_t>(any(2, 5))},
                   .origin = Vec3d(any(-3, 3), any(-3, 3), any(-3, 3)),
                   .spacing = Vec3d(0.25 * any(1, 8), 0.25 * any(1, 8), 0.25 * any(1, 8)),
                   .voxels = {}};
    Bytes bytes;
    const int values = any(1, 200);
    for (std::size_t i = 0; i < grid.count(); ++i) {
        const int value = any(0, values);
        const auto append = [&](auto number) {
            const auto* from = reinterpret_cast<const std::byte*>(&number);
            bytes.insert(bytes.end(), from, from + sizeof number);
        };
        switch (grid.format) {
            case VoxelFormat::kUint8:
                append(static_cast<std::uint8_t>(value));
                break;
            case VoxelFormat::kUint16:
                append(static_cast<std::uint16_t>(value));
                break;
            case VoxelFormat::kInt16:
                append(static_cast<std::int16_t>(value));
                break;
            case VoxelFormat::kFloat:
                append(static_cast<float>(value));
                break;
        }
    }
    grid.voxels = bytes;
    const double value = any(0, 2) == 0 ? any(0, values) : any(0, values) + 0.37;
    const Expected<MeshData> mesh = isoSurface(grid, value, 100'000);
    ASSERT_TRUE(mesh);
    ASSERT_TRUE(checkMesh(mesh->toArrays()));
    EXPECT_TRUE(isClosedSurface(*mesh));
    for (int i = 0; i < 40; ++i) {
        Vec3d steps;
        for (std::size_t axis = 0; axis < 3; ++axis)
            steps[static_cast<Eigen::Index>(axis)] =
                std::uniform_real_distribution<double>(0, static_cast<double>(grid.size[axis] - 1))(random);
        const double field = linearInTetrahedra(grid, steps);
        if (std::abs(field - value) < 1e-3 * values) continue;  // on the surface, as far as floats go
        const Vec3d point = grid.origin + grid.spacing.cwiseProduct(steps);
        ASSERT_NEAR(windingAround(*mesh, point), field > value ? 1.0 : 0.0, 1e-3)
            << "field " << field << ", value " << value;
    }
}
INSTANTIATE_TEST_SUITE_P(Seeds, IsoSurfaceOfAnything, testing::Range(0, 200));

TEST(IsoSurface, IsCoarserWhereItWouldHaveTooManyTriangles) {
    // Shells of a ball that reach through the sides of the box.
    const Vec3d origin(-1, -2, 3), spacing(0.5, 0.25, 0.125);
    const OwnGrid field({41, 40, 37}, origin, spacing,
                        [&](const Vec3d& p) { return std::sin(0.5 * (p - origin).cwiseQuotient(spacing).norm()); });
    const Expected<MeshData> all = isoSurface(field.grid, 0.1, 1'000'000);
    ASSERT_TRUE(all);
    const std::size_t triangles = all->indices.size() / 3;
    const MeshData same = isoSurfaceWithin(field.grid, 0.1, triangles);
    EXPECT_EQ(same.indices, all->indices);
    EXPECT_EQ(same.positions, all->positions);
    const auto boxOf = [](const MeshData& mesh) {
        Eigen::AlignedBox3f box;
        for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3)
            box.extend(Eigen::Vector3f(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]));
        return box;
    };
    std::size_t before = triangles;
    for (const std::size_t most : {triangles - 1, triangles / 5, triangles / 30, std::size_t{100}}) {
        SCOPED_TRACE(most);
        const MeshData coarse = isoSurfaceWithin(field.grid, 0.1, most);
        ASSERT_FALSE(coarse.indices.empty());
        EXPECT_LE(coarse.indices.size() / 3, most);
        EXPECT_LT(coarse.indices.size() / 3, before);
        EXPECT_TRUE(checkMesh(coarse.toArrays()));
        EXPECT_TRUE(isClosedSurface(coarse));
        if (most == triangles - 1) {  // half of the voxels still tell the shells: from side to side of the same box
            EXPECT_TRUE(boxOf(coarse).isApprox(boxOf(*all), 1e-5f));
        }
        before = coarse.indices.size() / 3;
    }
    EXPECT_TRUE(isoSurfaceWithin(field.grid, 0.1, 0).indices.empty());
    EXPECT_TRUE(isoSurfaceWithin(field.grid, 7, 0).indices.empty());
}

TEST(VoxelGrid, IsLinearBetweenItsNumbers) {
    const OwnGrid field({3, 4, 5}, Vec3d::Zero(), Vec3d::Ones(),
                        [](const Vec3d& p) { return 2 * p.x() - 3 * p.y() + p.z() + 1; });
    for (const Vec3d& p : {Vec3d(0, 0, 0), Vec3d(2, 3, 4), Vec3d(0.5, 1.25, 3.75), Vec3d(1.999, 0.001, 2)})
        EXPECT_NEAR(field.grid.linearAt(p), 2 * p.x() - 3 * p.y() + p.z() + 1, 1e-12);
    EXPECT_EQ(field.grid.linearAt(Vec3d(-5, 99, 2)), field.grid.linearAt(Vec3d(0, 3, 2)));
}

}  // namespace
}  // namespace tessera
