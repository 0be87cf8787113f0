#include "server/sim/records/StateComparison.h"

#include <gtest/gtest.h>

#include "server/sim/commit/Committer.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

std::vector<HashEntry> leavesOf(const Aspect& replica) {
    std::vector<HashEntry> entries;
    for (const Aspect::LeafHash& leaf : replica.leafHashes()) entries.push_back({leaf.leaf, leaf.hash});
    return entries;
}

std::vector<HashEntry> objectsOf(const Aspect& replica, std::uint64_t leaf) {
    std::vector<HashEntry> entries;
    for (const Aspect::ObjectHash& object : replica.objectHashes(leaf))
        entries.push_back({object.id.value, object.hash});
    return entries;
}

/// Plays the host's part: answers queries from `replica`.
StateComparison::Step walk(const Aspect& scene, const Aspect& replica) {
    StateComparison comparison;
    const StateComparison::Step step = comparison.leaves(scene, leavesOf(replica));
    return step.queryLeaf ? comparison.objects(scene, objectsOf(replica, *step.queryLeaf)) : step;
}

struct TwoScenes {
    TwoScenes() {
        EXPECT_TRUE(committer.apply(test::craneScene()));
        EXPECT_TRUE(replica.apply(snapshot(committer.scene())));
    }
    Committer committer;
    Aspect replica;
};

TEST(StateComparison, NamesTheFirstObjectThatDiffers) {
    TwoScenes s;
    ASSERT_TRUE(s.replica.apply(test::moveTo(test::transformAt(s.replica, "/wall"), Vec3d(4.0000001, 0, 0))));
    const StateComparison::Step step = walk(s.committer.scene(), s.replica);
    EXPECT_TRUE(step.named);
    EXPECT_WORDS(step.finding);
}

TEST(StateComparison, SaysWhereNoneDiffers) {
    TwoScenes s;
    const StateComparison::Step step = walk(s.committer.scene(), s.replica);
    EXPECT_FALSE(step.queryLeaf);
    EXPECT_FALSE(step.named);
    EXPECT_WORDS(step.finding);
}

TEST(StateComparison, BelievesNothing) {
    TwoScenes s;
    const Aspect& scene = s.committer.scene();
    StateComparison comparison;
    // Leaves twice and in disorder, of which one is nowhere near.
    std::vector<HashEntry> theirs = leavesOf(s.replica);
    constexpr std::uint64_t kFar = 1'000'000;
    theirs.insert(theirs.begin(), {kFar, 1});
    theirs.insert(theirs.begin(), theirs.back());
    const StateComparison::Step step = comparison.leaves(scene, theirs);
    ASSERT_TRUE(step.queryLeaf);
    EXPECT_EQ(*step.queryLeaf, kFar);
    EXPECT_FALSE(comparison.objects(scene, objectsOf(s.replica, 0)).named) << "objects of another leaf";
    EXPECT_WORDS(comparison.objects(scene, std::vector<HashEntry>{{kFar * Aspect::kIdsPerLeaf + 7, 7}}).finding);
    // None at all.
    EXPECT_EQ(comparison.leaves(scene, {}).queryLeaf, leavesOf(scene).front().key);
    EXPECT_WORDS(comparison.objects(scene, {}).finding);
}

}  // namespace
}  // namespace tessera
