#include "server/collision/query/SelfCollision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/unit/collision/Shapes.h"
#include "tests/unit/query/Bodies.h"
#include "tests/unit/query/SelfTouchOracle.h"

namespace tessera {
namespace {

using bodies::meshOf;
using oracle::Point;

TriangleMesh meshOf(const std::vector<double>& positions, const std::vector<std::uint32_t>& indices) {
    Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const double>(positions), indices);
    EXPECT_TRUE(mesh.has_value()) << (mesh ? "" : mesh.error().message);
    return std::move(*mesh);
}

std::vector<FacePair> allPairs(const TriangleMesh& mesh, const SelfTouchOptions& options = {}) {
    std::vector<FacePair> out;
    for (std::uint32_t a = 0; a < mesh.faceCount(); ++a)
        for (std::uint32_t b = a + 1; b < mesh.faceCount(); ++b)
            if (touchBeyondAdjacency(mesh, a, b, options)) out.push_back({a, b});
    return out;
}

std::vector<FacePair> found(const TriangleTree& tree, const SelfTouchOptions& options = {}) {
    QueryWork work;
    FacePairs pairs = selfTouching(tree, work, options);
    EXPECT_TRUE(pairs.complete);
    return std::move(pairs.pairs);
}

/// Two triangles, the first with corners 0, 1, 2.
bool touch(const std::vector<Vec3d>& points, const std::vector<std::uint32_t>& second, bool weld = false) {
    std::vector<double> positions;
    for (const Vec3d& p : points) positions.insert(positions.end(), p.data(), p.data() + 3);
    std::vector<std::uint32_t> indices{0, 1, 2};
    indices.insert(indices.end(), second.begin(), second.end());
    const TriangleMesh mesh = meshOf(positions, indices);
    const bool result = touchBeyondAdjacency(mesh, 0, 1, {.weldEqualPositions = weld});
    EXPECT_EQ(touchBeyondAdjacency(mesh, 1, 0, {.weldEqualPositions = weld}), result);
    return result;
}

TEST(SelfCollision, NeighboursTouchOnlyWhereTheyAreNotNeighbours) {
    const Vec3d o(0, 0, 0), x(4, 0, 0), y(0, 4, 0);
    EXPECT_FALSE(touch({o, x, y, Vec3d(4, 4, 0)}, {2, 1, 3})) << "two halves of a square";
    EXPECT_FALSE(touch({o, x, y, Vec3d(1, 1, 3)}, {2, 1, 3})) << "a sharp fold, not closed";
    EXPECT_TRUE(touch({o, x, y, Vec3d(1, 1, 0)}, {2, 1, 3})) << "the fold closed";
    EXPECT_FALSE(touch({o, x, y, Vec3d(-3, 0, 1), Vec3d(0, -3, 1)}, {0, 3, 4})) << "a common corner";
    EXPECT_TRUE(touch({o, x, y, Vec3d(1, 1, 1), Vec3d(1, 1, -1)}, {0, 3, 4})) << "a common corner, and pierced";
    EXPECT_TRUE(touch({o, x, y, Vec3d(2, 0, 0), Vec3d(0, -3, 1)}, {0, 3, 4})) << "half an edge in common";
    EXPECT_FALSE(touch({o, x, y, Vec3d(-2, 0, 0), Vec3d(0, -3, 1)}, {0, 3, 4})) << "an edge that goes on";
    EXPECT_TRUE(touch({o, x, y, Vec3d(1, 2, 0), Vec3d(-3, 1, 0)}, {0, 3, 4})) << "in one plane, overlapping";
    EXPECT_FALSE(touch({o, x, y, Vec3d(-1, 2, 0), Vec3d(-3, 1, 0)}, {0, 3, 4})) << "in one plane, side by side";
    EXPECT_TRUE(touch({o, x, y}, {2, 1, 0})) << "the same face, looking the other way";
    EXPECT_TRUE(touch({o, x, y, Vec3d(2, 0, 0), Vec3d(3, -1, 0), Vec3d(1, -1, 0)}, {3, 4, 5})) << "a T-junction";
}

TEST(SelfCollision, CornersAtOnePlaceAreOneOnRequest) {
    const Vec3d o(0, 0, 0), x(4, 0, 0), y(0, 4, 0);
    const std::vector<Vec3d> split{o, x, y, y, x, Vec3d(4, 4, 0)};
    EXPECT_TRUE(touch(split, {3, 4, 5}));
    EXPECT_FALSE(touch(split, {3, 4, 5}, true));
}

TEST(SelfCollision, TrianglesWithoutAreaAreSegments) {
    const Vec3d o(0, 0, 0), x(4, 0, 0), y(0, 4, 0);
    EXPECT_FALSE(touch({o, x, y, Vec3d(-4, 0, 0)}, {0, 3, 3})) << "leaves the corner outwards";
    EXPECT_TRUE(touch({o, x, y, Vec3d(1, 1, 0)}, {0, 3, 3})) << "leaves it into the face";
    EXPECT_TRUE(touch({o, x, y, Vec3d(-1, -1, 0), Vec3d(1, 1, 0)}, {0, 3, 4})) << "passes it into the face";
    EXPECT_FALSE(touch({o, x, y}, {0, 1, 1})) << "is the edge";
    EXPECT_FALSE(touch({o, x, y, Vec3d(6, 0, 0)}, {0, 1, 3})) << "is the edge and goes on";
    EXPECT_FALSE(touch({o, x, Vec3d(2, 0, 0)}, {0, 1, 2})) << "the same segment twice";
    EXPECT_TRUE(touch({o, x, Vec3d(5, 0, 0), Vec3d(6, 0, 0)}, {0, 1, 3})) << "both go on";
}

class IntegerSoups : public testing::TestWithParam<int> {};

TEST_P(IntegerSoups, AgreeWithTheDefinition) {
    std::array<int, 4> touching{}, free{};
    for (int seed = 0; seed < 1500; ++seed) {
        SCOPED_TRACE(testing::Message() << "grid " << GetParam() << ", seed " << seed);
        std::mt19937_64 random(static_cast<std::uint64_t>(1000 * GetParam() + seed));
        std::uniform_int_distribution<int> k(0, GetParam());
        std::uniform_int_distribution<std::uint32_t> corner(0, 6);
        std::vector<Point> points(7);
        std::vector<double> positions;
        for (Point& p : points) {
            const int x = k(random), y = k(random), z = k(random);
            p = {x, y, z};
            const Vec3d v = oracle::toDouble(p);
            positions.insert(positions.end(), v.data(), v.data() + 3);
        }
        std::vector<std::uint32_t> indices(3 * 9);
        for (std::uint32_t& i : indices) i = corner(random);
        const TriangleMesh mesh = meshOf(positions, indices);
        const TriangleTree tree(mesh, {.volume = static_cast<VolumeKind>(seed % 7)});
        for (const bool weld : {false, true}) {
            std::vector<FacePair> truth;
            for (std::uint32_t a = 0; a < 9; ++a)
                for (std::uint32_t b = a + 1; b < 9; ++b) {
                    std::vector<Point> shared;
                    for (std::size_t i = 0; i < 3; ++i)
                        for (std::size_t j = 0; j < 3; ++j) {
                            const std::uint32_t u = indices[3 * a + i], v = indices[3 * b + j];
                            if (weld ? !oracle::same(points[u], points[v]) : u != v) continue;
                            if (std::none_of(shared.begin(), shared.end(),
                                             [&](const Point& p) { return oracle::same(p, points[u]); }))
                                shared.push_back(points[u]);
                        }
                    const auto triangle = [&](std::uint32_t f) {
                        return oracle::IntTriangle{points[indices[3 * f]], points[indices[3 * f + 1]],
                                                   points[indices[3 * f + 2]]};
                    };
                    const bool touches = oracle::touchBeyond(triangle(a), triangle(b), shared);
                    ASSERT_EQ(touchBeyondAdjacency(mesh, a, b, {.weldEqualPositions = weld}), touches) << a << " " << b;
                    ASSERT_EQ(touchBeyondAdjacency(mesh, b, a, {.weldEqualPositions = weld}), touches) << a << " " << b;
                    if (touches) truth.push_back({a, b});
                    ++(touches ? touching : free)[shared.size()];
                }
            ASSERT_EQ(found(tree, {.weldEqualPositions = weld}), truth);
        }
    }
    for (std::size_t shared = 0; shared < 3; ++shared) {
        EXPECT_GT(touching[shared], 100) << shared;
        EXPECT_GT(free[shared], 100) << shared;
    }
    EXPECT_GT(touching[3], 20);
}

INSTANTIATE_TEST_SUITE_P(GridSizes, IntegerSoups, testing::Values(1, 2, 3, 6));

TEST(SelfCollision, ClosedSurfacesHaveNone) {
    EXPECT_TRUE(found(TriangleTree(meshOf(shapes::box(Vec3d(1, 2, 3))))).empty());
    EXPECT_TRUE(found(TriangleTree(meshOf(shapes::sphere(1, 60, 90)))).empty());
    EXPECT_TRUE(found(TriangleTree(TriangleMesh{})).empty());
    // Two spheres in one mesh that run into each other have a ring of pairs.
    shapes::Soup two = shapes::sphere(1, 20, 30);
    const shapes::Soup second = two;
    const auto offset = static_cast<std::uint32_t>(two.positions.size() / 3);
    for (std::size_t i = 0; i < second.positions.size(); ++i)
        two.positions.push_back(second.positions[i] + (i % 3 == 0 ? 0.9f : 0.1f));
    for (const std::uint32_t i : second.indices) two.indices.push_back(i + offset);
    const TriangleMesh mesh = meshOf(two);
    const std::vector<FacePair> pairs = found(TriangleTree(mesh));
    EXPECT_EQ(pairs, allPairs(mesh));
    EXPECT_GT(pairs.size(), 50u);
    for (const FacePair& p : pairs) EXPECT_TRUE(p.a < second.indices.size() / 3 && p.b >= second.indices.size() / 3);
}

/// A square cloth of n × n quads in the plane z = 0.
struct Cloth {
    std::uint32_t n;
    std::vector<Vec3d> positions;
    std::vector<std::uint32_t> indices;

    explicit Cloth(std::uint32_t quads) : n(quads) {
        for (std::uint32_t j = 0; j <= n; ++j)
            for (std::uint32_t i = 0; i <= n; ++i) positions.emplace_back(i, j, 0);
        for (std::uint32_t j = 0; j < n; ++j)
            for (std::uint32_t i = 0; i < n; ++i) {
                const std::uint32_t at = j * (n + 1) + i;
                indices.insert(indices.end(), {at, at + 1, at + n + 2, at, at + n + 2, at + n + 1});
            }
    }
    [[nodiscard]] TriangleMesh mesh() const {
        std::vector<double> flat;
        for (const Vec3d& p : positions) flat.insert(flat.end(), p.data(), p.data() + 3);
        return meshOf(flat, indices);
    }
    template <typename Move>
    [[nodiscard]] std::vector<Vec3d> moved(const Move& move) const {
        std::vector<Vec3d> out;
        for (const Vec3d& p : positions) out.push_back(move(p));
        return out;
    }
};

TEST(SelfCollision, ClothFoldedFlatLiesOnItself) {
    const Cloth cloth(8);
    TriangleTree tree(cloth.mesh());
    EXPECT_TRUE(found(tree).empty()) << "flat";
    // Folded along x = 4, open by a hair: each half is one plane, the halves meet in the fold alone.
    const auto folded = [](double height) {
        return [height](const Vec3d& p) { return p.x() <= 4 ? p : Vec3d(8 - p.x(), p.y(), height * (p.x() - 4)); };
    };
    ASSERT_TRUE(tree.refit(cloth.moved(folded(1e-12))).has_value());
    EXPECT_TRUE(found(tree).empty());
    ASSERT_TRUE(tree.refit(cloth.moved(folded(0))).has_value());
    const std::vector<FacePair> pairs = found(tree);
    EXPECT_EQ(pairs, allPairs(tree.mesh()));
    // Each face of the upper half lies on the mirror image of itself: of the 64 quads' two halves some cross.
    std::vector<char> hit(tree.mesh().faceCount(), 0);
    for (const FacePair& p : pairs) hit[p.a] = hit[p.b] = 1;
    EXPECT_EQ(std::count(hit.begin(), hit.end(), 1), static_cast<std::ptrdiff_t>(tree.mesh().faceCount()));
}

TEST(SelfCollision, FollowsAClothThatRollsUpAndThroughItself) {
    const Cloth cloth(14);
    for (const VolumeKind kind : {VolumeKind::kSphere, VolumeKind::kAabb, VolumeKind::kObb, VolumeKind::kDop18}) {
        TriangleTree tree(cloth.mesh(), {.volume = kind});
        std::size_t most = 0, frames = 0;
        for (int frame = 0; frame <= 24; ++frame) {
            // A roll of falling radius that bends more and more; from about frame 12 on it has gone all around.
            const double bend = 0.04 * frame;
            const std::vector<Vec3d> now = cloth.moved([&](const Vec3d& p) -> Vec3d {
                if (bend == 0) return p;
                const double angle = bend * p.x(), radius = 1 / bend + 0.02 * p.y();
                return {radius * std::sin(angle), p.y() + 0.01 * p.x(), radius * (1 - std::cos(angle))};
            });
            ASSERT_TRUE(tree.refit(now).has_value());
            const std::vector<FacePair> pairs = found(tree);
            ASSERT_EQ(pairs, allPairs(tree.mesh())) << "frame " << frame;
            most = std::max(most, pairs.size());
            frames += !pairs.empty();
        }
        EXPECT_GT(most, 50u);
        EXPECT_GT(frames, 5u);
        EXPECT_LT(frames, 20u);
    }
}

TEST(SelfCollision, SaysSoWhenTheWorkIsExhausted) {
    const Cloth cloth(20);
    TriangleTree tree(cloth.mesh());
    ASSERT_TRUE(tree.refit(cloth.moved([](const Vec3d& p) { return Vec3d(p.x(), p.y() * 0.1, 0); })).has_value());
    QueryWork work{.limit = 40};
    EXPECT_FALSE(selfTouching(tree, work).complete);
    QueryWork none{.limit = 0};
    EXPECT_FALSE(selfTouching(tree, none).complete);
    QueryWork all;
    EXPECT_TRUE(selfTouching(tree, all).complete);
    EXPECT_GT(all.triangleTests, 800u);
}

std::filesystem::path dataFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data";
}

/// `v` and `f` lines of a Wavefront OBJ, polygons fanned.
shapes::Soup readObj(const std::filesystem::path& file) {
    shapes::Soup soup;
    std::ifstream in(file);
    std::string line, word;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        words >> word;
        if (word == "v") {
            float x, y, z;
            words >> x >> y >> z;
            soup.positions.insert(soup.positions.end(), {x, y, z});
        } else if (word == "f") {
            std::vector<std::uint32_t> corners;
            while (words >> word) corners.push_back(static_cast<std::uint32_t>(std::stoul(word) - 1));
            for (std::size_t i = 2; i < corners.size(); ++i)
                soup.indices.insert(soup.indices.end(), {corners[0], corners[i - 1], corners[i]});
        }
        word.clear();
    }
    return soup;
}

struct Model {
    const char* file;
    bool clean;
};

void PrintTo(const Model& model, std::ostream* out) {
    *out << model.file;
}

class RealSurfaces : public testing::TestWithParam<Model> {};

TEST_P(RealSurfaces, RunIntoThemselvesOrNot) {
    const auto file = dataFolder() / GetParam().file;
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << dataFolder() << " (set TESSERA_TEST_DATA)";
    const TriangleMesh mesh = meshOf(readObj(file));
    const std::vector<FacePair> pairs = found(TriangleTree(mesh));
    EXPECT_EQ(pairs.empty(), GetParam().clean);
    EXPECT_TRUE(mesh.faceCount() > 5000 || pairs == allPairs(mesh));
}

INSTANTIATE_TEST_SUITE_P(Data, RealSurfaces,
                         testing::Values(Model{"meshes/spot/spot_low_resolution.obj", true},
                                         Model{"meshes/hand/hand_lowres.obj", true},
                                         Model{"meshes/fish/fish_low_resolution.obj", true},
                                         Model{"meshes/cube/cube.obj", true}, Model{"plant/Gasket.obj", true},
                                         Model{"collision/fcl_rob.obj", false}, Model{"collision/fcl_env.obj", false}),
                         [](const auto& test) { return std::filesystem::path(test.param.file).stem().string(); });

}  // namespace
}  // namespace tessera
