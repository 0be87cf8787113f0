#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/Predicates.h"
#include "tests/unit/convex/ConvexShapes.h"
#include "tests/unit/convex/IntegerOracle.h"

namespace tessera {
namespace {

using convextest::hullOf;
using convextest::Points;
using convextest::Random;

/// Closed, connected like a ball, convex at every edge, and around all the points: all of it by exact signs.
void expectExactBody(const ConvexHull& hull, const Points& points) {
    ASSERT_EQ(hull.dimension(), 3);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> opposite;
    for (const ConvexHull::Face& f : hull.faces())
        for (std::size_t i = 0; i < 3; ++i) {
            const bool isNew = opposite.emplace(std::pair(f[i], f[(i + 1) % 3]), f[(i + 2) % 3]).second;
            ASSERT_TRUE(isNew) << "a directed edge occurs twice";
        }
    const auto v = hull.vertices();
    for (const auto& [edge, corner] : opposite) {
        const auto other = opposite.find({edge.second, edge.first});
        ASSERT_NE(other, opposite.end()) << "an open edge";
        ASSERT_LE(orient3d(v[edge.first], v[edge.second], v[corner], v[other->second]), 0) << "a dent";
    }
    EXPECT_EQ(v.size() + hull.faces().size(), opposite.size() / 2 + 2) << "Euler";
    for (const ConvexHull::Face& f : hull.faces()) {
        ASSERT_FALSE(isDegenerate({v[f[0]], v[f[1]], v[f[2]]}));
        // A surface convex at each edge that has these points behind each side is the hull's.
        if (points.size() * hull.faces().size() > 30'000'000) continue;
        for (const Vec3d& p : points) ASSERT_LE(orient3d(v[f[0]], v[f[1]], v[f[2]], p), 0) << "a point outside";
    }
    for (std::size_t i = 0; i < v.size(); ++i) {
        ASSERT_EQ(v[i], points[hull.sources()[i]]);
        ASSERT_TRUE(i == 0 || hull.sources()[i - 1] < hull.sources()[i]);
    }
}

/// Planes in three independent directions meet in every vertex: none lies inside an edge or a side. (Integers.)
void expectTrueCorners(const ConvexHull& hull) {
    std::vector<std::vector<oracle::Point>> normals(hull.vertices().size());
    const auto at = [&](std::uint32_t i) {
        const Vec3d& p = hull.vertices()[i];
        return oracle::Point{oracle::Wide(p.x()), oracle::Wide(p.y()), oracle::Wide(p.z())};
    };
    for (const ConvexHull::Face& f : hull.faces())
        for (const std::uint32_t c : f) normals[c].push_back(oracle::cross(at(f[1]) - at(f[0]), at(f[2]) - at(f[0])));
    for (const auto& around : normals) {
        bool corner = false;
        for (const auto& a : around)
            for (const auto& b : around)
                for (const auto& c : around) corner = corner || oracle::dot(a, oracle::cross(b, c)) != 0;
        ASSERT_TRUE(corner);
    }
}

TEST(ConvexHull, OfABoxIsItsEightCorners) {
    const ConvexHull hull = hullOf(convextest::box(Vec3d(1, 2, 3)));
    expectExactBody(hull, convextest::box(Vec3d(1, 2, 3)));
    EXPECT_EQ(hull.vertices().size(), 8u);
    EXPECT_EQ(hull.faces().size(), 12u);
    EXPECT_EQ(hull.bounds().size(), Vec3d(1, 2, 3));
    EXPECT_LT(hull.centre().norm(), 1e-15);
    EXPECT_TRUE(hull.contains(Vec3d(0.5, 1, 1.5)));
    EXPECT_TRUE(hull.contains(Vec3d(0.5, 0, 0)));
    EXPECT_FALSE(hull.contains(Vec3d(std::nextafter(0.5, 1), 0, 0)));
}

TEST(ConvexHull, OfFewPointsIsWhatTheyAre) {
    const Vec3d p(1, 2, 3), q(4, 4, 4), middle = 0.5 * (p + q);
    const ConvexHull point = hullOf({p, p, p});
    EXPECT_EQ(point.dimension(), 0);
    EXPECT_EQ(point.vertices().size(), 1u);
    EXPECT_TRUE(point.faces().empty());
    EXPECT_TRUE(point.neighbours(0).empty());
    EXPECT_TRUE(point.contains(p));
    EXPECT_FALSE(point.contains(q));

    const ConvexHull segment = hullOf({middle, q, p, middle, q});
    EXPECT_EQ(segment.dimension(), 1);
    ASSERT_EQ(segment.vertices().size(), 2u);
    EXPECT_EQ(segment.vertices()[0], q) << "in the order in which they came";
    EXPECT_EQ(segment.sources()[1], 2u);
    EXPECT_EQ(segment.neighbours(0).size(), 1u);
    EXPECT_TRUE(segment.contains(middle));
    EXPECT_FALSE(segment.contains(middle + Vec3d(0, 0, 1e-15)));

    // A square with its middle, points on its edges, and each corner twice; skew in space.
    Points square;
    for (int i = 0; i <= 2; ++i)
        for (int j = 0; j <= 2; ++j)
            for (int twice = 0; twice < 2; ++twice) square.emplace_back(i + j, i - j, 2 * i + 3 * j);
    const ConvexHull polygon = hullOf(square);
    EXPECT_EQ(polygon.dimension(), 2);
    EXPECT_EQ(polygon.vertices().size(), 4u);
    EXPECT_EQ(polygon.faces().size(), 4u) << "two triangles on either side";
    EXPECT_TRUE(polygon.contains(square[8]));
    EXPECT_FALSE(polygon.contains(square[8] + Vec3d(0, 0, 1e-12)));
}

TEST(ConvexHull, OfAMillionPointsOfAGridIsACube) {
    Points grid;
    for (int i = 0; i < 100; ++i)
        for (int j = 0; j < 100; ++j)
            for (int k = 0; k < 100; ++k) grid.emplace_back(i, j, k);
    const ConvexHull hull = hullOf(grid);
    expectExactBody(hull, grid);
    EXPECT_EQ(hull.vertices().size(), 8u);
    EXPECT_EQ(hull.faces().size(), 12u);
    EXPECT_EQ(hull.sources().front(), 0u);
    EXPECT_EQ(hull.sources().back(), 999'999u);
}

TEST(ConvexHull, OfAMillionPointsOnASphere) {
    const Points points = convextest::sphere(1, 1'000'000);
    const ConvexHull hull = hullOf(points);
    expectExactBody(hull, points);
    EXPECT_GT(hull.vertices().size(), 990'000u);
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3d d = convextest::unitVector(random);
        std::uint64_t looks = 0;
        const Vec3d found = hull.vertices()[hull.support(d, ConvexHull::kAnyVertex, looks)];
        EXPECT_GT(found.dot(d), 1 - 1e-5);
        EXPECT_LT(looks, 2'000u) << "climbed, not scanned";
    }
}

TEST(ConvexHull, OfSmallIntegersHasOnlyTrueCorners) {
    for (int seed = 0; seed < 3000; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        std::uniform_int_distribution<int> count(4, 40), k(0, 1 + seed % 6);
        Points points;
        for (int i = count(random); i > 0; --i) {
            const int x = k(random), y = k(random), z = k(random);
            points.emplace_back(x, y, z);
        }
        const ConvexHull hull = hullOf(points);
        for (const Vec3d& p : points) ASSERT_TRUE(hull.contains(p));
        if (hull.dimension() < 3) continue;
        expectExactBody(hull, points);
        expectTrueCorners(hull);
        if (HasFatalFailure()) return;
    }
}

TEST(ConvexHull, OfRoundedPlanesAndNeedlesIsExact) {
    for (int seed = 0; seed < 300; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(static_cast<std::uint64_t>(seed));
        // Sides that are flat but for rounding, turned any way; far from the origin every third time.
        Affine3d m = Affine3d(convextest::rotation(random));
        m.linear() *= Vec3d(1, std::pow(10.0, -(seed % 13)), 1).asDiagonal();
        if (seed % 3 == 0) m.pretranslate(1000 * convextest::normalVector(random));
        Points points;
        std::uniform_int_distribution<int> k(0, 6);
        for (int i = 0; i < 400; ++i) {
            const int x = k(random), y = k(random), z = k(random);
            points.emplace_back(m * Vec3d(x / 6.0, y / 6.0, z / 6.0));
        }
        const ConvexHull hull = hullOf(points);
        if (hull.dimension() == 3) expectExactBody(hull, points);
        if (HasFatalFailure()) return;
    }
}

TEST(ConvexHull, IsTheSameForPointsInAnotherOrder) {
    Random random(5);
    Points points = convextest::cloud(3000, random);
    for (const Vec3d& p : convextest::box(Vec3d(9, 9, 9))) points.push_back(p);
    const ConvexHull hull = hullOf(points);
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), random);
    Points shuffled;
    for (const std::size_t i : order) shuffled.push_back(points[i]);
    const ConvexHull other = hullOf(shuffled);
    std::vector<std::size_t> a(hull.sources().begin(), hull.sources().end()), b;
    for (const std::uint32_t s : other.sources()) b.push_back(order[s]);
    std::sort(b.begin(), b.end());
    EXPECT_EQ(a, b);
    EXPECT_EQ(hull.faces().size(), other.faces().size());
}

TEST(ConvexHull, OfAMeshIsThatOfTheVerticesInUse) {
    const std::vector<double> positions{99, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const std::vector<std::uint32_t> indices{1, 2, 3, 1, 2, 4};
    const Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const double>(positions), indices);
    ASSERT_TRUE(mesh.has_value());
    const Expected<ConvexHull> hull = ConvexHull::make(*mesh);
    ASSERT_TRUE(hull.has_value());
    EXPECT_EQ(std::vector<std::uint32_t>(hull->sources().begin(), hull->sources().end()),
              (std::vector<std::uint32_t>{1, 2, 3, 4}));
    EXPECT_EQ(hull->faces().size(), 4u);
}

TEST(ConvexHull, RefusesWhatHasNone) {
    const auto message = [](const Points& points, const ConvexHullLimits& limits = {}) {
        const Expected<ConvexHull> hull = ConvexHull::make(points, limits);
        return hull ? std::string() : hull.error().message;
    };
    EXPECT_EQ(message({}), "no points, so no convex hull");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message({Vec3d(0, 0, 0), Vec3d(0, nan, 0)}), "point 1 has a coordinate that is not finite or too large");
    EXPECT_EQ(message({Vec3d(0, 0, 1e51)}), "point 0 has a coordinate that is not finite or too large");
    EXPECT_EQ(message({Vec3d(0, 0, 0), Vec3d(1, 0, 0)}, {.maxPoints = 1}), "2 points, at most 1");
    EXPECT_FALSE(ConvexHull::make(TriangleMesh{}).has_value());
}

TEST(ConvexHull, TakesWhatIsTooSmallToMultiplyForZero) {
    Points points = convextest::box(Vec3d(2, 2, 2));
    points.emplace_back(1e-310, -1e-200, 1e-61);
    points.emplace_back(1, 1e-300, -1e-90);
    const ConvexHull hull = hullOf(points);
    expectExactBody(hull, points);
    EXPECT_EQ(hull.vertices().size(), 8u);
    const ConvexHull small = hullOf({Vec3d(1e-70, 0, 0), Vec3d(0, 1e-80, 0)});
    EXPECT_EQ(small.dimension(), 0);
}

/// No vertex may lie farther, to within what the sum itself is rounded by.
void expectFarthest(const ConvexHull& hull, const Vec3d& d, std::uint32_t found) {
    const double size = hull.bounds().lower.cwiseAbs().cwiseMax(hull.bounds().upper.cwiseAbs()).dot(d.cwiseAbs());
    for (const Vec3d& v : hull.vertices()) ASSERT_LE(d.dot(v - hull.vertices()[found]), 2e-15 * size);
}

TEST(ConvexHull, FindsTheFarthestVertexFromAnywhere) {
    Random random(2);
    for (int kind = 0; kind < 30; ++kind) {
        const ConvexHull hull = hullOf(kind < 20   ? convextest::anyBody(kind, random)
                                       : kind < 25 ? convextest::sphere(2, 5000)
                                                   : convextest::prism(1, 1, 1500));
        std::uniform_int_distribution<std::uint32_t> any(0, static_cast<std::uint32_t>(hull.vertices().size() - 1));
        for (int i = 0; i < 200; ++i) {
            Vec3d d = convextest::unitVector(random);
            // Nearly along a side's normal, where heights differ by rounding.
            if (i % 3 == 0 && !hull.faces().empty()) {
                const ConvexHull::Face& f = hull.faces()[static_cast<std::size_t>(any(random)) % hull.faces().size()];
                const auto v = hull.vertices();
                d = (v[f[1]] - v[f[0]]).cross(v[f[2]] - v[f[0]]).normalized() + 1e-13 * d;
            }
            if (i % 7 == 0) d *= std::pow(10.0, i - 100);
            std::uint64_t looks = 0;
            expectFarthest(hull, d, hull.support(d, i % 2 ? any(random) : ConvexHull::kAnyVertex, looks));
            if (HasFatalFailure()) return;
        }
        std::uint64_t looks = 0;
        EXPECT_LT(hull.support(Vec3d::Zero(), ConvexHull::kAnyVertex, looks), hull.vertices().size());
    }
}

TEST(ConvexHull, LooksAtFewVerticesOfMany) {
    Random random(3);
    for (const Points& points : {convextest::sphere(1, 20'000), convextest::prism(1, 2, 10'000)}) {
        const ConvexHull hull = hullOf(points);
        ASSERT_EQ(hull.vertices().size(), 20'000u);
        std::uint64_t looks = 0;
        constexpr int kAsked = 2000;
        for (int i = 0; i < kAsked; ++i)
            (void)hull.support(convextest::unitVector(random), ConvexHull::kAnyVertex, looks);
        EXPECT_LT(looks, kAsked * 200u);
    }
}

std::filesystem::path dataFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data";
}

/// The vertices of a Wavefront OBJ or of an ASCII OFF.
Points readVertices(const std::filesystem::path& file) {
    std::ifstream in(file);
    Points points;
    std::string word;
    if (file.extension() == ".off") {
        std::size_t vertices = 0, faces = 0, edges = 0;
        in >> word >> vertices >> faces >> edges;
        double x, y, z;
        while (points.size() < vertices && in >> x >> y >> z) points.emplace_back(x, y, z);
        return points;
    }
    std::string line;
    while (std::getline(in, line))
        if (line.starts_with("v ")) {
            float x = 0, y = 0, z = 0;
            std::sscanf(line.c_str(), "v %f %f %f", &x, &y, &z);
            points.emplace_back(x, y, z);
        }
    return points;
}

class RealHulls : public testing::TestWithParam<const char*> {};

TEST_P(RealHulls, AreExact) {
    const auto file = dataFolder() / GetParam();
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << dataFolder() << " (set TESSERA_TEST_DATA)";
    const Points points = readVertices(file);
    ASSERT_GT(points.size(), 7u);
    const ConvexHull hull = hullOf(points);
    expectExactBody(hull, points);
}

INSTANTIATE_TEST_SUITE_P(Data, RealHulls,
                         testing::Values("cad/ballA.off", "cad/ballB.off", "meshes/spot/spot_low_resolution.obj",
                                         "meshes/hand/hand_lowres.obj", "meshes/cube/cube.obj", "collision/fcl_rob.obj",
                                         "collision/fcl_env.obj", "plant/Gasket.obj", "plant/Structural_steel.obj"),
                         [](const auto& test) { return std::filesystem::path(test.param).stem().string(); });

}  // namespace
}  // namespace tessera
