/// Points as triangles are judged as solids; spacing and laying by what plain geometry says.
#include "common/geometry/Points.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace tessera {
namespace {

Vec3d at(std::span<const float> array, std::size_t v) {
    return {array[3 * v], array[3 * v + 1], array[3 * v + 2]};
}

MeshArrays pointsAt(const std::vector<float>& positions, double radius) {
    MeshData points{.positions = positions, .primitive = Primitive::kPoints, .pointRadius = radius};
    return points.toArrays();
}

TEST(Points, AreOctahedraThatFaceOutwards) {
    MeshData data{.positions = {1, 2, 3, -4, 0, 5}, .primitive = Primitive::kPoints, .pointRadius = 0.5};
    data.colors = {10, 20, 30, 40, 50, 60, 70, 80};
    data.texcoords = {0.1f, 0.2f, 0.3f, 0.4f};
    const MeshArrays points = data.toArrays();
    ASSERT_TRUE(checkMesh(points));
    const MeshData mesh = trianglesOfPoints(points);
    EXPECT_EQ(mesh.primitive, Primitive::kTriangles);
    ASSERT_TRUE(checkMesh(mesh.toArrays()));
    ASSERT_EQ(mesh.positions.size(), 3 * 2 * kVerticesPerPoint);
    ASSERT_EQ(mesh.indices.size(), 3 * 2 * kFacesPerPoint);
    EXPECT_EQ(triangleCount(points), 2 * kFacesPerPoint);
    for (std::size_t point = 0; point < 2; ++point) {
        const Vec3d centre = at(points.positions.as<float>(), point);
        double volume = 0;
        for (std::size_t face = point * kFacesPerPoint; face < (point + 1) * kFacesPerPoint; ++face) {
            std::array<Vec3d, 3> corners;
            for (std::size_t k = 0; k < 3; ++k) corners[k] = at(mesh.positions, mesh.indices[3 * face + k]) - centre;
            const Vec3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            EXPECT_GT(normal.dot(corners[0]), 0) << "face " << face << " looks inwards";
            volume += corners[0].dot(corners[1].cross(corners[2])) / 6;
            // Octants count as documented.
            const std::size_t octant = face % kFacesPerPoint;
            const Vec3d middle = corners[0] + corners[1] + corners[2];
            for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(middle[axis] < 0, (octant >> axis & 1) != 0);
            const auto found = cornersOf(points, static_cast<std::uint32_t>(face), shownRadius(points));
            ASSERT_TRUE(found);
            for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ((*found)[k].cast<double>(), corners[k] + centre);
        }
        EXPECT_NEAR(volume, 4.0 / 3 * 0.5 * 0.5 * 0.5, 1e-9) << "a regular octahedron's";
        for (std::size_t v = point * kVerticesPerPoint; v < (point + 1) * kVerticesPerPoint; ++v) {
            EXPECT_NEAR((at(mesh.positions, v) - centre).norm(), 0.5, 1e-6);
            EXPECT_NEAR((at(mesh.normals, v) - (at(mesh.positions, v) - centre) / 0.5).norm(), 0, 1e-6);
            EXPECT_EQ(mesh.colors[4 * v + 3], data.colors[4 * point + 3]);
            EXPECT_EQ(mesh.texcoords[2 * v + 1], data.texcoords[2 * point + 1]);
        }
    }
    EXPECT_FALSE(cornersOf(points, 2 * kFacesPerPoint, 0.5));
}

TEST(Points, HaveTheirOwnNormalsWhereTheyHaveSome) {
    MeshData data{.positions = {1, 2, 3}, .normals = {0, 0.6f, 0.8f}, .primitive = Primitive::kPoints};
    const MeshData mesh = trianglesOfPoints(data.toArrays());
    for (std::size_t v = 0; v < kVerticesPerPoint; ++v) EXPECT_EQ(at(mesh.normals, v), at(data.normals, 0));
}

TEST(Points, APartOfThemIsThatPartOfAll) {
    const MeshArrays points = pointsAt({0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0}, 0.25);
    const MeshData all = trianglesOfPoints(points), part = trianglesOfPoints(points, 0.25, {1, 3});
    ASSERT_EQ(part.positions.size(), 2u * 18);
    EXPECT_TRUE(std::equal(part.positions.begin(), part.positions.end(), all.positions.begin() + 18));
    const std::vector<std::uint32_t> indices = indicesOfPoints({1, 3});
    EXPECT_TRUE(std::equal(indices.begin(), indices.end(), all.indices.begin() + 24));
}

TEST(Points, WithoutARadiusAreSeenAllTheSame) {
    EXPECT_EQ(shownRadius(pointsAt({0, 0, 0, 3, 4, 0}, 0)), 5.0 / 2000);
    EXPECT_EQ(shownRadius(pointsAt({7, 7, 7}, 0)), 1.0 / 2000);
    EXPECT_EQ(shownRadius(pointsAt({7, 7, 7}, 0.3)), 0.3);
}

// Rounded corners too, wherever they lie.
TEST(Points, BoundsHoldWhatIsShown) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> exponent(-3, 9), part(-1, 1);
    for (int turn = 0; turn < 200; ++turn) {
        std::vector<float> positions;
        const float size = std::pow(10.0f, exponent(random));
        for (int i = 0; i < 9; ++i) positions.push_back(size * part(random));
        const MeshArrays points = pointsAt(positions, turn % 3 == 0 ? 0.0 : double{size} * std::abs(part(random)));
        const Box box = shownBounds(points);
        const MeshData mesh = trianglesOfPoints(points);
        for (std::size_t v = 0; v < mesh.positions.size() / 3; ++v)
            EXPECT_TRUE(box.contains(at(mesh.positions, v))) << "turn " << turn << ", vertex " << v;
        const double radius = shownRadius(points);
        EXPECT_TRUE(box.contains(at(positions, 0) + Vec3d(radius, -radius, radius))) << turn;
        EXPECT_LT((box.size() - boundsOf(positions).size()).maxCoeff(), 2 * radius + 1e-6 * size) << turn;
    }
    EXPECT_TRUE(shownBounds(pointsAt({}, 1)).empty());
    const float most = std::numeric_limits<float>::max();
    EXPECT_TRUE(checkMesh(trianglesOfPoints(pointsAt({most, -most, most}, 1e12)).toArrays())) << "finite still";
}

TEST(CheckMesh, RefusesWhatPointsCannotHave) {
    MeshArrays points = pointsAt({0, 0, 0, 1, 0, 0}, 0.1);
    EXPECT_TRUE(checkMesh(points));
    const auto refusal = [](const MeshArrays& arrays, const MeshLimits& limits = {}) {
        const Expected<void> checked = checkMesh(arrays, limits);
        return checked ? std::string() : checked.error().message;
    };
    for (const double radius : {-0.1, 2e12, std::numeric_limits<double>::quiet_NaN()}) {
        points.pointRadius = radius;
        EXPECT_WORDS(refusal(points));
    }
    points.pointRadius = 0;
    EXPECT_EQ(refusal(points, {.maxPoints = 1}), "2 points, at most 1 are allowed");
    const std::vector<std::uint32_t> indices = {0, 1, 0};
    points.indices = Blob::of(std::span<const std::uint32_t>(indices));
    EXPECT_EQ(refusal(points), "points have no triangle indices: leave the array out");
    points.indices = Blob();
    const std::vector<std::uint8_t> colors = {1, 2, 3, 4};
    points.colors = Blob::of(std::span<const std::uint8_t>(colors));
    EXPECT_WORDS(refusal(points));
}

/// By looking at all of them.
double nearestOf(std::span<const float> positions, std::size_t point) {
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < positions.size() / 3; ++i) {
        const double distance = (at(positions, i) - at(positions, point)).norm();
        if (distance > 0) best = std::min(best, distance);
    }
    return best;
}

TEST(Spacing, OfAGridIsItsStep) {
    std::vector<float> grid;
    for (int i = 0; i < 40; ++i)
        for (int j = 0; j < 60; ++j) grid.insert(grid.end(), {5, 0.25f * float(i), 0.25f * float(j)});
    EXPECT_DOUBLE_EQ(spacingOf(grid), 0.25);
    const std::vector<float> once = grid;
    grid.insert(grid.end(), once.begin(), once.end());
    EXPECT_DOUBLE_EQ(spacingOf(grid), 0.25) << "each point twice";
}

TEST(Spacing, IsTheMedianOfWhatLookingAtAllFinds) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> part(-1, 1);
        std::vector<float> cloud;
        const std::size_t count = 5 + random() % 240;  // fewer than a sample: every point is in it
        for (std::size_t i = 0; i < 3 * count; ++i) cloud.push_back(part(random) * (i % 3 == seed % 3 ? 9 : 1));
        std::vector<double> distances;
        for (std::size_t i = 0; i < count; ++i) distances.push_back(nearestOf(cloud, i));
        std::sort(distances.begin(), distances.end());
        EXPECT_DOUBLE_EQ(spacingOf(cloud), distances[count / 2]) << "seed " << seed;
    }
}

TEST(Spacing, OfNothingOrOnePlaceIsZero) {
    EXPECT_EQ(spacingOf({}), 0);
    EXPECT_EQ(spacingOf(std::vector<float>{1, 2, 3}), 0);
    EXPECT_EQ(spacingOf(std::vector<float>{1, 2, 3, 1, 2, 3}), 0);
}

// Points in two places must not all be looked at from each.
TEST(Spacing, OfTwoCrowdedPlacesEnds) {
    std::vector<float> crowd;
    for (int i = 0; i < 300'000; ++i) crowd.insert(crowd.end(), {i % 2 == 0 ? 0.0f : 4.0f, 0, 0});
    const double spacing = spacingOf(crowd);
    EXPECT_TRUE(spacing == 0 || spacing == 4) << spacing;
}

TEST(PointsOnSurface, LieOnItEvenlyWithItsNormals) {
    const Expected<MeshData> points = pointsOnSurface(makeSphere(2, 64), 0.1);
    ASSERT_TRUE(points);
    EXPECT_EQ(points->primitive, Primitive::kPoints);
    ASSERT_TRUE(checkMesh(points->toArrays()));
    const std::size_t count = points->positions.size() / 3;
    EXPECT_NEAR(static_cast<double>(count), 4 * std::numbers::pi * 4 / 0.01, 0.01 * static_cast<double>(count));
    int upper = 0, octant = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d place = at(points->positions, i), normal = at(points->normals, i);
        EXPECT_NEAR(place.norm(), 2, 0.005);
        EXPECT_NEAR(normal.norm(), 1, 1e-5);
        EXPECT_GT(normal.dot(place) / 2, 0.99);
        upper += place.y() > 0 ? 1 : 0;
        octant += (place.array() > 0).all() ? 1 : 0;
    }
    EXPECT_NEAR(upper, static_cast<double>(count) / 2, 0.01 * static_cast<double>(count));
    EXPECT_NEAR(octant, static_cast<double>(count) / 8, 0.01 * static_cast<double>(count));
    // Points drawn by lot would be half of 1 / sqrt(density) apart in the mean, those of a grid 1.
    EXPECT_GT(spacingOf(points->positions), 0.05);
    EXPECT_LE(spacingOf(points->positions), 0.1);
    const Expected<MeshData> again = pointsOnSurface(makeSphere(2, 64), 0.1);
    EXPECT_EQ(again->positions, points->positions);
}

TEST(PointsOnSurface, RefusesTooMany) {
    const Expected<MeshData> points = pointsOnSurface(makeBox({1, 1, 1}), 0.01, 59'999);
    ASSERT_FALSE(points);
    EXPECT_EQ(points.error().code, ErrorCode::kLimit);
    EXPECT_EQ(points.error().message, "60000 points, at most 59999 are allowed");
}

}  // namespace
}  // namespace tessera
