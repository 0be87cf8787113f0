// Motions that have nothing to do with each other are tried at once: with the results, the work and the order of one
// after the other.
#include <gtest/gtest.h>

#include <random>

#include "common/base/Workers.h"
#include "tests/unit/pipeline/SameResults.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// With so little work motions are tried one after the other.
constexpr std::uint64_t kOneByOne = 199'999;

/// Heaps of blocks far from each other, each with a post that stands. Blocks of a heap are in each other's way, so a
/// heap's are tried one after the other; their transforms come in turns, heap by heap, and in some heaps one block
/// carries another.
struct Heaps : SceneMaker {
    Heaps(std::uint64_t seed, std::uint64_t maxTests, Workers* workers)
        : SceneMaker({.maxTests = maxTests}, workers), random(seed) {
        constexpr std::int64_t kOfMovers[] = {Interest::kStop, Interest::kSlide, Interest::kAsk, Interest::kRollback};
        std::vector<ObjectId> groups;
        for (int heap = 0; heap < 8; ++heap) {
            groups.push_back(node(kRootNode));
            (void)body(groups.back(), shapes::box(Vec3d(0.3, 2, 0.3)), place(heap));
        }
        std::vector<ObjectId> below = groups;
        for (int layer = 0; layer < 4; ++layer)
            for (std::size_t heap = 0; heap < groups.size(); ++heap) {
                const bool carried = heap % 3 == 2 && layer % 2 == 1;
                const Vec3d off(number(-1.2, 1.2), 1.2 * layer - 1.5, number(-1.2, 1.2));
                const shapes::Soup soup = layer % 2 ? shapes::box(Vec3d(0.9, 0.5, 0.7)) : shapes::sphere(0.5, 5, 7);
                blocks.push_back(body(carried ? below[heap] : groups[heap], soup,
                                      carried ? Vec3d(0.4, 1, 0.2) : Vec3d(place(static_cast<int>(heap)) + off)));
                below[heap] = blocks.back().node;
                CollisionObject itself;
                itself.node = blocks.back().node;
                (void)object(itself);
            }
        for (std::size_t heap = 0; heap < groups.size(); ++heap)
            (void)interest(groups[heap], groups[heap], kOfMovers[heap % 4]);
    }
    static Vec3d place(int heap) { return {20.0 * heap, 0, 0}; }
    double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

    StepResult next() {
        std::vector<TentativeTransform> wishes;
        for (const Body& block : blocks) {
            const Transform& now = at(block.transform);
            const Vec3d by(number(-0.4, 0.4), number(-0.2, 0.2), number(-0.4, 0.4));
            wishes.push_back({.transform = block.transform,
                              .translation = now.translation + by,
                              .rotation = Quatd(1, number(-0.1, 0.1), number(-0.1, 0.1), 0) * now.rotation});
        }
        return frame(wishes);
    }

    std::mt19937_64 random;
    std::vector<Body> blocks;
};

class MotionsAtOnce : public testing::TestWithParam<std::uint64_t> {};

TEST_P(MotionsAtOnce, GoAsOneAfterTheOther) {
    Workers three(3);
    Heaps single(GetParam(), kOneByOne, nullptr), together(GetParam(), CollisionLimits{}.maxTests, nullptr),
        shared(GetParam(), CollisionLimits{}.maxTests, &three);
    std::size_t stopped = 0, questions = 0;
    for (int frame = 0; frame < 40 && !HasFailure(); ++frame) {
        const StepResult result = single.next();
        ASSERT_LT(result.counters.boxTests + result.counters.triangleTests, kOneByOne) << "too much for this test";
        expectEqual(result, together.next());
        expectEqual(result, shared.next());
        ASSERT_EQ(single.aspect.stateHash(), together.aspect.stateHash());
        ASSERT_EQ(single.aspect.stateHash(), shared.aspect.stateHash());
        stopped += result.stopped.size();
        questions += result.questions.size();
    }
    EXPECT_GT(stopped, 100u);
    EXPECT_GT(questions, 0u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, MotionsAtOnce, testing::Values(1, 2, 3));

/// A sheet that turns over another one at a hair's breadth costs a million tests.
struct Sheets : SceneMaker {
    Sheets(int count, std::uint64_t maxTests, Workers* workers) : SceneMaker({.maxTests = maxTests}, workers) {
        const ObjectId movers = node(kRootNode), standing = node(kRootNode);
        for (int i = 0; i < count; ++i) {
            const Vec3d here(10.0 * i, 0, 0);
            (void)body(standing, sheet(), here);
            sheets.push_back(body(movers, sheet(), here + Vec3d(0, 3e-4, 0)));
        }
        (void)interest(movers, standing, Interest::kStop);
    }
    static shapes::Soup sheet() {
        constexpr std::uint32_t kSide = 48;
        shapes::Soup out;
        for (std::uint32_t i = 0; i <= kSide; ++i)
            for (std::uint32_t j = 0; j <= kSide; ++j)
                for (const float x : {static_cast<float>(i) / kSide - 0.5F, 0.0F, static_cast<float>(j) / kSide - 0.5F})
                    out.positions.push_back(x);
        for (std::uint32_t i = 0; i < kSide; ++i)
            for (std::uint32_t j = 0; j < kSide; ++j) {
                const std::uint32_t v = i * (kSide + 1) + j;
                for (const std::uint32_t corner : {v, v + 1, v + kSide + 2, v, v + kSide + 2, v + kSide + 1})
                    out.indices.push_back(corner);
            }
        return out;
    }
    StepResult turn() {
        std::vector<TentativeTransform> wishes;
        for (const Body& sheet : sheets)
            wishes.push_back({.transform = sheet.transform,
                              .translation = at(sheet.transform).translation + Vec3d(0.05, 0, 0),
                              .rotation = Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitY()))});
        return frame(wishes);
    }
    std::vector<Body> sheets;
};

/// Where the work is not enough for all, the first have theirs in full, as if nobody had been tried beside them.
TEST(MotionsAtOnce, TheFirstHaveTheirWorkInFull) {
    Workers three(3);
    Sheets one(1, CollisionLimits{}.maxTests, nullptr);
    const StepCounters alone = one.turn().counters;
    const std::uint64_t each = alone.boxTests + alone.triangleTests;
    ASSERT_GT(each, 150'000u) << "too little for this test";
    const std::uint64_t limit = 5 * each / 2;
    Sheets here(4, limit, nullptr), there(4, limit, &three);
    const StepResult result = here.turn();
    expectEqual(result, there.turn());
    EXPECT_EQ(result.stopped, (std::vector<ObjectId>{here.sheets[2].transform, here.sheets[3].transform}));
    EXPECT_GT(result.counters.notLookedAt, 0u);
    EXPECT_LT(result.counters.boxTests + result.counters.triangleTests, limit + each);
}

}  // namespace
}  // namespace tessera
