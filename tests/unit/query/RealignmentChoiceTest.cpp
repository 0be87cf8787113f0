// Realignment by planes and by table: what is tested differs, and how large it is; what is answered does not.
#include <gtest/gtest.h>

#include <set>

#include "server/collision/query/TouchQuery.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

struct Asked {
    FacePairs all;
    Touch any = Touch::kUnknown;
    std::uint64_t tests = 0;
    PlacedVolumes placed;
};

Asked ask(const TriangleTree& a, const TriangleTree& b, const Affine3d& pose, Realignment realignment,
          InstructionSet set) {
    Asked out;
    QueryWork work;
    const TouchOptions options{.realignment = realignment, .placed = &out.placed, .instructions = set};
    out.all = allTouching(a, b, pose, work, options);
    out.tests = work.boxTests;
    out.any = firstTouching(a, b, pose, work, options).touch;
    // Whoever measures changes nothing.
    QueryWork unmeasured;
    EXPECT_EQ(allTouching(a, b, pose, unmeasured, {.realignment = realignment, .instructions = set}).pairs,
              out.all.pairs);
    EXPECT_EQ(unmeasured.boxTests, out.tests);
    return out;
}

TEST(RealignmentChoice, ChangesWhatIsTestedAndNoAnswer) {
    int met = 0, apart = 0, differing = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Random random(seed);
        const TriangleMesh models[] = {bumpy(random, 20, 30), strewn(random, 400, 0.3),
                                       roughGround(random, 20, 0.2, 0.1), bumpy(random, 12, 16)};
        for (const VolumeKind volume : {VolumeKind::kDop14, VolumeKind::kDop18, VolumeKind::kDop26}) {
            const auto treeOf = [&](const TriangleMesh& mesh) {
                return TriangleTree(mesh, {.volume = volume, .profiles = true});
            };
            const TriangleTree trees[] = {treeOf(models[0]), treeOf(models[1]), treeOf(models[2]), treeOf(models[3])};
            std::uint64_t testsByPlanes = 0, testsByTable = 0;
            PlacedVolumes byPlanes, byTable;
            for (int i = 0; i < 40; ++i) {
                const std::size_t a = random() % 4, b = random() % 4;
                const Affine3d pose = composeTransform(between(random, 0.5, 3) * inCube(random, 1).normalized(),
                                                       anyRotation(random), Vec3d::Ones());
                const Asked planes = ask(trees[a], trees[b], pose, Realignment::kThreePlanes, instructionSet());
                const Asked table = ask(trees[a], trees[b], pose, Realignment::kTable, instructionSet());
                ASSERT_EQ(planes.all.pairs, table.all.pairs) << "seed " << seed << ", pose " << i;
                ASSERT_EQ(planes.any, table.any) << "seed " << seed << ", pose " << i;
                (planes.all.pairs.empty() ? apart : met) += 1;
                testsByPlanes += planes.tests;
                testsByTable += table.tests;
                for (auto [sum, one] : {std::pair(&byPlanes, planes.placed), std::pair(&byTable, table.placed)}) {
                    sum->count += one.count;
                    sum->volume += one.volume;
                }
            }
            differing += testsByPlanes != testsByTable ? 1 : 0;
            ASSERT_GT(byPlanes.count, 100U);
            ASSERT_GT(byTable.count, 100U);
            EXPECT_NE(byPlanes.volume / static_cast<double>(byPlanes.count),
                      byTable.volume / static_cast<double>(byTable.count));
        }
    }
    EXPECT_GT(met, 100);
    EXPECT_GT(apart, 50);
    EXPECT_GT(differing, 8) << "of twelve";
}

TEST(RealignmentChoice, BoxesAreNoSmallerThanWhatTheyHoldOnAnyInstructionSet) {
    const TriangleMesh box = meshOf(shapes::box(Vec3d(1, 1, 1)));
    const TriangleTree tree(box, {.volume = VolumeKind::kDop18, .profiles = true});
    // A corner of A lies in B and the opposite one does not, however B is turned: bodies within each other would not
    // touch.
    const Affine3d pose =
        composeTransform({0.9, 0.8, 0.7}, Quatd(0.9, 0.1, -0.2, 0.3).normalized(), Vec3d::Constant(2));
    for (const Realignment realignment : {Realignment::kThreePlanes, Realignment::kTable}) {
        std::set<std::uint64_t> counts;
        for (const InstructionSet set : instructionSets()) {
            const Asked asked = ask(tree, tree, pose, realignment, set);
            ASSERT_GT(asked.placed.count, 0U);
            counts.insert(asked.placed.count);
            // The root holds eight units cubed, and leaves hold flat pieces: their mean is what is asked for, in A's
            // units.
            EXPECT_GT(asked.placed.volume, 8) << name(set);
            EXPECT_LT(asked.placed.volume, 8 * 3 * static_cast<double>(asked.placed.count)) << name(set);
        }
        EXPECT_EQ(counts.size(), 1U);
    }
    PlacedVolumes none;
    QueryWork work;
    const TriangleTree oriented(box, {.volume = VolumeKind::kObb});
    EXPECT_FALSE(allTouching(oriented, oriented, pose, work, {.placed = &none}).pairs.empty());
    EXPECT_EQ(none.count, 0U) << "what is no k-DOP is not measured";
}

}  // namespace
}  // namespace tessera
