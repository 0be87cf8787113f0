// What a set of points keeps, and what it refuses.
#include "server/collision/representation/PointSet.h"

#include <gtest/gtest.h>

#include <limits>

#include "server/collision/tree/TriangleTree.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

std::vector<Vec3d> cloud(bodies::Random& random, std::size_t count, bool asFloats) {
    std::vector<Vec3d> out;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d p = bodies::inCube(random, 3);
        out.push_back(asFloats ? Vec3d(p.cast<float>().cast<double>()) : p);
        if (i % 9 == 8) out.back() = out[i / 2];
    }
    return out;
}

TEST(PointSet, EveryPointIsInOneLeafAndInAllBoxesAboveIt) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        bodies::Random random(seed);
        const std::size_t count = 1 + random() % (seed % 4 == 0 ? 9000 : 300);
        const std::vector<Vec3d> points = cloud(random, count, seed % 2);
        const PointSet set = *PointSet::make(points, 0.25);
        const std::string story = "seed " + std::to_string(seed);
        ASSERT_EQ(set.size(), count) << story;
        std::vector<int> seen(count);
        std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>> open{{0, {0}}};
        std::size_t leaves = 0;
        while (!open.empty()) {
            const auto [node, above] = open.back();
            open.pop_back();
            const PointSet::Children of = set.children(node);
            ASSERT_LT(of.first, of.end) << story;
            ASSERT_LE(of.end - of.first, PointSet::kFanOut) << story;
            for (std::uint32_t child = of.first; child < of.end; ++child) {
                if (child < set.firstLeaf()) {
                    std::vector<std::uint32_t> with = above;
                    with.push_back(child);
                    open.emplace_back(child, with);
                    continue;
                }
                ++leaves;
                for (const std::uint32_t number : set.pointsOf(child)) {
                    ++seen[number];
                    for (const std::uint32_t box : above) ASSERT_TRUE(set.box(box).contains(points[number])) << story;
                }
            }
        }
        EXPECT_EQ(leaves, (count + 3) / 4) << story;
        EXPECT_TRUE(std::ranges::all_of(seen, [](int times) { return times == 1; })) << story;
        Box all;
        for (std::uint32_t i = 0; i < count; ++i) {
            ASSERT_EQ(set.point(i), points[i]) << story;
            all.extend(points[i]);
        }
        EXPECT_EQ(set.centres().lower, all.lower) << story;
        EXPECT_EQ(set.bounds().upper, Vec3d(all.upper.array() + 0.25)) << story;
    }
}

TEST(PointSet, TakesLittleMoreThanItsPoints) {
    bodies::Random random(3);
    const std::vector<Vec3d> floats = cloud(random, 50'000, true), doubles = cloud(random, 50'000, false);
    const auto perPoint = [](std::size_t bytes) { return static_cast<double>(bytes) / 50'000; };
    EXPECT_LT(perPoint(PointSet::make(floats, 1)->memoryBytes()), 17);
    EXPECT_LT(perPoint(PointSet::make(doubles, 1)->memoryBytes()), 29);
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < floats.size(); ++i) {
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(floats[i][k]));
        indices.insert(indices.end(), {i, i, i});
    }
    const TriangleTree tree(*TriangleMesh::make(std::span<const float>(positions), indices));
    EXPECT_LT(4 * perPoint(PointSet::make(floats, 1)->memoryBytes()), perPoint(tree.memoryBytes()));
}

TEST(PointSet, RefusesWhatIsNoNumberAndTakesNoPoints) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const std::vector<Vec3d> good{Vec3d::Zero(), Vec3d::Ones()};
    EXPECT_EQ(PointSet::make({}, 1)->size(), 0u);
    EXPECT_TRUE(PointSet::make({}, 1)->bounds().empty());
    EXPECT_TRUE(PointSet::make(good, 0));
    for (const double radius : {-1.0, nan, infinity, 2e50})
        EXPECT_EQ(PointSet::make(good, radius).error().code, ErrorCode::kBadInput);
    for (const double x : {nan, infinity, -2e50}) {
        std::vector<Vec3d> bad = good;
        bad[1].y() = x;
        EXPECT_EQ(PointSet::make(bad, 1).error().message, "point 1 has a coordinate that is not finite or too large");
    }
    EXPECT_EQ(PointSet::make(good, 1, {.maxPoints = 1}).error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace tessera
