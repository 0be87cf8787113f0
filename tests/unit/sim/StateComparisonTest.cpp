#include "server/sim/StateComparison.h"

#include <gtest/gtest.h>

#include "server/sim/commit/Committer.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

/// Plays the host's part: answers queries from `replica`.
StateComparison::Step walk(StateComparison& comparison, const Aspect& scene, const Aspect& replica) {
    server_action::HashesReceived leaves{.host = "left", .objects = false, .entries = {}};
    for (const Aspect::LeafHash& leaf : replica.leafHashes()) leaves.entries.push_back({leaf.leaf, leaf.hash});
    const StateComparison::Step step = comparison.compare(leaves, scene);
    if (!step.queryLeaf) return step;
    server_action::HashesReceived objects{.host = "left", .objects = true, .entries = {}};
    for (const Aspect::ObjectHash& object : replica.objectHashes(*step.queryLeaf))
        objects.entries.push_back({object.id.value, object.hash});
    return comparison.compare(objects, scene);
}

TEST(StateComparison, NamesTheFirstObjectThatDiffers) {
    Committer committer;
    ASSERT_TRUE(committer.apply(test::craneScene()));
    Aspect replica;
    ASSERT_TRUE(replica.apply(snapshot(committer.scene())));
    ASSERT_TRUE(replica.apply(test::moveTo(test::transformAt(replica, "/wall"), Vec3d(4.0000001, 0, 0))));
    StateComparison comparison;
    comparison.begin("left", committer.scene());
    const StateComparison::Step step = walk(comparison, committer.scene(), replica);
    EXPECT_NE(step.finding.find("(Transform)"), std::string::npos) << step.finding;
    EXPECT_NE(step.finding.find("differs"), std::string::npos);
}

TEST(StateComparison, ComparesWithTheSceneAsItWasAtTheMismatch) {
    Committer committer;
    ASSERT_TRUE(committer.apply(test::craneScene()));
    Aspect replica;
    ASSERT_TRUE(replica.apply(snapshot(committer.scene())));
    StateComparison comparison;
    comparison.begin("left", committer.scene());
    ASSERT_TRUE(committer.apply(test::moveTo(test::transformAt(committer.scene(), "/wall"), Vec3d(8, 0, 0))));
    EXPECT_TRUE(walk(comparison, committer.scene(), replica).finding.empty());
}

TEST(StateComparison, AnUnknownHostGetsNothing) {
    StateComparison comparison;
    const Aspect scene;
    const StateComparison::Step step = comparison.compare({.host = "nobody", .objects = false, .entries = {}}, scene);
    EXPECT_FALSE(step.queryLeaf);
    EXPECT_TRUE(step.finding.empty());
}

}  // namespace
}  // namespace tessera
