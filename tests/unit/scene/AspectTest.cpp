#include "common/cores/Group.h"
#include "common/cores/Interest.h"
#include "common/scene/Aspect.h"

#include <gtest/gtest.h>

#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

TEST(Aspect, HoldsTheRootAndNothingElseWhenFresh) {
    const Aspect aspect;
    EXPECT_EQ(aspect.ids(), std::vector{kRootNode});
    EXPECT_EQ(aspect.nextFreeId(), 2u);
    EXPECT_TRUE(aspect.root().children.empty());
    EXPECT_EQ(aspect.stateHash(), Aspect().stateHash());
}

TEST(Aspect, AppliesCreationsPlacementsValuesAndDestructions) {
    Aspect aspect = hall();
    EXPECT_EQ(aspect.objectCount(), 7u);
    EXPECT_EQ(aspect.get<Node>(ObjectId(2))->children, (std::vector{ObjectId(3), ObjectId(4)}));
    EXPECT_EQ(aspect.coreOf<Transform>(*aspect.get<Node>(ObjectId(3)))->translation, Vec3d(1, 2, 3));
    EXPECT_EQ(aspect.useCount(ObjectId(7)), 1u);
    EXPECT_EQ(aspect.nextFreeId(), 8u);

    mustApply(aspect, Edits().under(4, 0).gone(4).gone(6).gone(7).take());

    EXPECT_EQ(aspect.objectCount(), 4u);
    EXPECT_FALSE(aspect.find(ObjectId(6)));
    EXPECT_EQ(aspect.nextFreeId(), 8u) << "an id is never free again";
}

TEST(Aspect, PutsANodeAtItsIndexAmongTheChildrenItFinds) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().node(10, "floor", 0).under(10, 2, 1).take());
    EXPECT_EQ(aspect.get<Node>(ObjectId(2))->children, (std::vector{ObjectId(3), ObjectId(10), ObjectId(4)}));
    mustApply(aspect, Edits().under(3, 2, 2).take());
    EXPECT_EQ(aspect.get<Node>(ObjectId(2))->children, (std::vector{ObjectId(10), ObjectId(4), ObjectId(3)}));
}

TEST(Aspect, SharesACoreAmongNodesAndCountsItsUses) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().node(10, "second hook").coreOfNode(10, 6).take());
    EXPECT_EQ(aspect.useCount(ObjectId(6)), 2u);
    mustApply(aspect, Edits().coreOfNode(10, 0).take());
    EXPECT_EQ(aspect.useCount(ObjectId(6)), 1u);
}

TEST(Aspect, LetsObjectsThatNameEachOtherGoTogether) {
    Aspect aspect = hall();
    // The node's core is an interest in the node itself: neither can go first.
    mustApply(aspect, Edits()
                          .node(10, "probe", 0)
                          .core<Interest>(11, 10)
                          .value<Interest>(11, fieldId<&Interest::object>, ObjectId(10))
                          .take());
    const StateHash before = hall().stateHash();
    mustApply(aspect, Edits().gone(10).gone(11).take());
    EXPECT_EQ(aspect.stateHash(), before);
}

TEST(Aspect, AnObjectMayComeAndGoInOneList) {
    Aspect aspect = hall();
    const StateHash before = aspect.stateHash();
    mustApply(aspect, Edits().node(20, "flash").under(20, 0).core<Group>(21).gone(20).gone(21).take());
    EXPECT_EQ(aspect.stateHash(), before);
    EXPECT_EQ(aspect.nextFreeId(), 22u);
}

TEST(Aspect, TakesAChildFromItsParentAndTheParentAwayInOneList) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().under(3, 1).under(4, 1).under(2, 0).gone(2).take());
    EXPECT_EQ(aspect.root().children, (std::vector{ObjectId(3), ObjectId(4)}));
}

TEST(StateHash, DoesNotDependOnHowTheSceneCameToBe) {
    Aspect direct = hall();
    Aspect detour = hall();
    mustApply(detour, Edits()
                          .node(30, "scaffold", 3)
                          .value<Transform>(5, fieldId<&Transform::translation>, toValue(Vec3d(9, 9, 9)))
                          .under(3, 1)
                          .take());
    mustApply(detour, Edits()
                          .under(30, 0)
                          .gone(30)
                          .under(3, 2, 0)
                          .value<Transform>(5, fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)))
                          .take());
    EXPECT_EQ(detour.stateHash(), direct.stateHash());
    EXPECT_EQ(detour.leafHashes(), direct.leafHashes());
}

TEST(StateHash, SeesEveryFieldParentAndOrderOfChildren) {
    const StateHash before = hall().stateHash();
    const auto hashAfter = [](Edits& e) {
        Aspect aspect = hall();
        mustApply(aspect, e.take());
        return aspect.stateHash();
    };
    EXPECT_NE(hashAfter(Edits().value<Transform>(5, fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1.0000001)))),
              before);
    EXPECT_NE(hashAfter(Edits().value<Node>(4, fieldId<&Node::name>, toValue(std::string("Hook")))), before);
    EXPECT_NE(hashAfter(Edits().value<Material>(7, fieldId<&Material::doubleSided>, true)), before);
    EXPECT_NE(hashAfter(Edits().value<Geometry>(6, fieldId<&Geometry::positions>,
                                                Blob::of(std::span<const int>(std::array{1, 2, 3})))),
              before);
    EXPECT_NE(hashAfter(Edits().under(4, 2, 0)), before);
    EXPECT_NE(hashAfter(Edits().coreOfNode(4, 5)), before);
}

TEST(StateHash, TakesMinusZeroForZero) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().value<Transform>(5, fieldId<&Transform::translation>, toValue(Vec3d(0, 2, 3))).take());
    const StateHash zero = aspect.stateHash();
    mustApply(aspect, Edits().value<Transform>(5, fieldId<&Transform::translation>, toValue(Vec3d(-0.0, 2, 3))).take());
    EXPECT_EQ(aspect.stateHash(), zero);
}

TEST(StateHash, ItsTreeLeadsToTheObjectThatDiffers) {
    Aspect server = hall(), replica = hall();
    Edits far;
    for (std::uint64_t i = 0; i < 3000; ++i) far.core<Transform>(5000 + i);
    const ChangeList list = far.take();
    mustApply(server, list);
    mustApply(replica, list);
    mustApply(replica,
              Edits().value<Transform>(7001, fieldId<&Transform::translation>, toValue(Vec3d(0, 0, 1e-9))).take());

    const auto ours = server.leafHashes(), theirs = replica.leafHashes();
    ASSERT_EQ(ours.size(), theirs.size());
    std::vector<std::uint64_t> differing;
    for (std::size_t i = 0; i < ours.size(); ++i)
        if (ours[i] != theirs[i]) differing.push_back(ours[i].leaf);
    ASSERT_EQ(differing, std::vector{7001 / Aspect::kIdsPerLeaf});

    const auto objects = server.objectHashes(differing[0]), others = replica.objectHashes(differing[0]);
    ASSERT_EQ(objects.size(), others.size());
    for (std::size_t i = 0; i < objects.size(); ++i)
        EXPECT_EQ(objects[i] == others[i], objects[i].id != ObjectId(7001));
}

TEST(StateHash, EmptyLeavesVanish) {
    Aspect aspect;
    const StateHash before = aspect.stateHash();
    mustApply(aspect, Edits().core<Group>(1'000'000).core<Group>(2'000'000'000'000).take());
    EXPECT_EQ(aspect.leafHashes().size(), 3u);
    mustApply(aspect, Edits().gone(1'000'000).gone(2'000'000'000'000).take());
    EXPECT_EQ(aspect.leafHashes().size(), 1u);
    EXPECT_EQ(aspect.stateHash(), before);
}

TEST(Inverse, LeadsBackAndItsOwnInverseForwardAgain) {
    Aspect aspect = hall();
    const StateHash before = aspect.stateHash();
    Edits e;
    e.node(20, "new", 2)
        .core<Transform>(21, 20)
        .value<Transform>(21, fieldId<&Transform::scale>, toValue(Vec3d(2, 2, 2)));
    e.under(3, 1, 0).value<Transform>(5, fieldId<&Transform::rotation>, toValue(Quatd(0, 1, 0, 0)));
    e.coreOfNode(4, 0).under(4, 0).gone(4).gone(6);

    const Expected<ChangeList> undo = aspect.applyWithInverse(e.take());
    ASSERT_TRUE(undo) << undo.error().message;
    const StateHash after = aspect.stateHash();
    const Expected<ChangeList> redo = aspect.applyWithInverse(*undo);
    ASSERT_TRUE(redo) << redo.error().message;
    EXPECT_EQ(aspect.stateHash(), before);
    EXPECT_EQ(aspect.get<Geometry>(ObjectId(6))->material, ObjectId(7));

    mustApply(aspect, *redo);
    EXPECT_EQ(aspect.stateHash(), after);
}

TEST(Inverse, RestoresTheOrderAroundANodeThatCameAndWent) {
    Aspect aspect = hall();
    mustApply(aspect, Edits().node(10, "a", 2).node(11, "b", 2).take());
    const StateHash before = aspect.stateHash();
    // 20 holds 10 for a while and shifts its siblings' indices.
    const Expected<ChangeList> undo = aspect.applyWithInverse(Edits()
                                                                  .node(20, "basket", 0)
                                                                  .under(20, 2, 0)
                                                                  .under(10, 20)
                                                                  .under(11, 2, 1)
                                                                  .under(10, 2, 2)
                                                                  .under(20, 0)
                                                                  .gone(20)
                                                                  .take());
    ASSERT_TRUE(undo) << undo.error().message;
    EXPECT_NE(aspect.stateHash(), before);
    mustApply(aspect, *undo);
    EXPECT_EQ(aspect.stateHash(), before);
}

TEST(Snapshot, LeadsFromTheEmptySceneToThisOne) {
    Aspect aspect = hall();
    mustApply(aspect,
              Edits().value<Node>(1, fieldId<&Node::name>, toValue(std::string("world"))).core<Group>(50).take());
    mustApply(aspect, Edits().gone(50).node(40, "loose", 0).node(41, "child of loose", 40).take());
    Aspect copy;
    mustApply(copy, snapshot(aspect));
    EXPECT_EQ(copy.stateHash(), aspect.stateHash());
    EXPECT_EQ(copy.ids(), aspect.ids());
    EXPECT_EQ(copy.nextFreeId(), 51u);
    EXPECT_EQ(copy.root().name, "world");
    EXPECT_EQ(copy.useCount(ObjectId(7)), 1u);
}

TEST(Snapshot, OfAFreshSceneOnlyTellsTheNextFreeId) {
    ChangeList list = snapshot(Aspect());
    EXPECT_EQ(list.nextFreeId, 2u);
    EXPECT_EQ(list.changeCount(), 0u);
}

TEST(BlobsOf, NamesEachBlobOnce) {
    const Blob shared = Blob::of(std::span<const int>(std::array{1, 2, 3}));
    const Blob absent = Blob::absent(Hash128{1, 2}, 12);
    const ChangeList list = Edits()
                                .value<Geometry>(6, fieldId<&Geometry::positions>, shared)
                                .value<Geometry>(6, fieldId<&Geometry::normals>, shared)
                                .value<Geometry>(8, fieldId<&Geometry::positions>, absent)
                                .value<Geometry>(8, fieldId<&Geometry::normals>, Blob())
                                .take();
    EXPECT_EQ(blobsOf(list), (std::vector{shared, absent}));
}

}  // namespace
}  // namespace tessera
