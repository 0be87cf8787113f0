#include "server/sim/frame/Simulation.h"

#include <gtest/gtest.h>

#include "common/codec/ChangeCodec.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::craneScene;
using test::ListMaker;
using test::moveTo;
using test::one;
using test::placeOf;
using test::transformAt;

Simulation loaded(ChangeList list) {
    Simulation simulation;
    const Expected<CommittedFrame> frame = simulation.load({std::move(list)});
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    return simulation;
}

TEST(Simulation, MotionStandsInTheFirstFrameAndAdvancesByASixtieth) {
    Simulation simulation = loaded(craneScene());
    (void)simulation.step(true, {});
    EXPECT_EQ(placeOf(simulation.scene(), "/crane").x(), 0);
    (void)simulation.step(false, {});
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 0.1, 1e-12);
}

TEST(Simulation, StopsWhatAMotionDrivesIntoAWallAndSaysSo) {
    Simulation simulation = loaded(craneScene());
    FrameResult frame = simulation.step(true, {});
    std::uint64_t begun = 0;
    for (int i = 0; i < 120; ++i) {
        frame = simulation.step(false, {});
        begun += frame.collision.contactsBegun;
    }
    // The hook's face at x + 0.5 meets the wall's at 3.5.
    EXPECT_LE(placeOf(simulation.scene(), "/crane").x(), 3.0);
    EXPECT_GT(placeOf(simulation.scene(), "/crane").x(), 2.98);
    EXPECT_EQ(begun, 1u);
    ASSERT_FALSE(frame.collision.contacts.empty());
    EXPECT_EQ(pathOf(simulation.scene(), frame.collision.contacts.front().objectA), "/crane/hook");
    EXPECT_EQ(pathOf(simulation.scene(), frame.collision.contacts.front().objectB), "/wall/bricks");
    EXPECT_NEAR(frame.collision.contacts.front().normal.x(), 1, 1e-9);
}

TEST(Simulation, GoesOnWhenTheWallIsTakenAway) {
    Simulation simulation = loaded(craneScene());
    (void)simulation.step(true, {});
    for (int i = 0; i < 60; ++i) (void)simulation.step(false, {});
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(4, 10, 0))));
    for (int i = 0; i < 60; ++i) (void)simulation.step(false, {});
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6.0, 1e-9);
}

TEST(Simulation, WhatAPersonMovesObeysTheSameStop) {
    Simulation simulation = loaded(craneScene());
    (void)simulation.step(true, {});
    const FrameResult frame =
        simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/crane"), Vec3d(20, 0, 0))));
    ASSERT_TRUE(frame.outcomes.front().result);
    EXPECT_EQ(frame.outcomes.front().result->stopped, std::vector{transformAt(simulation.scene(), "/crane")});
    EXPECT_LE(placeOf(simulation.scene(), "/crane").x(), 3.0);
    EXPECT_GT(placeOf(simulation.scene(), "/crane").x(), 2.9);
}

TEST(Simulation, WhatStoppedAHandStaysListedUntilOneOfTheTwoMoves) {
    Simulation simulation = loaded(craneScene());
    (void)simulation.step(true, {});
    const ObjectId crane = transformAt(simulation.scene(), "/crane");
    EXPECT_EQ(simulation.step(false, one(moveTo(crane, Vec3d(20, 0, 0)))).collision.contactsBegun, 1u);
    for (int i = 0; i < 3; ++i) {
        const FrameResult later = simulation.step(false, {});
        EXPECT_FALSE(later.collision.contacts.empty()) << i;
        EXPECT_EQ(later.collision.contactsBegun, 0u) << i;
    }
    (void)simulation.step(false, one(moveTo(crane, Vec3d(-2, 0, 0))));
    EXPECT_TRUE(simulation.step(false, {}).collision.contacts.empty());
}

TEST(Simulation, AHandOnAMovingThingPausesItsMotionUntilToldOtherwise) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/crane"), Vec3d(0, 5, 0))));
    (void)simulation.step(false, {});
    EXPECT_EQ(placeOf(simulation.scene(), "/crane"), Vec3d(0, 5, 0));
    const ObjectId motion = simulation.scene().get<Node>(findNode(simulation.scene(), "/motion").value())->core;
    EXPECT_EQ(simulation.scene().get<Motion>(motion)->playing, 0);
    ChangeListBuilder play;
    play.set(motion, typeOf<Motion>(), fieldId<&Motion::playing>, true);
    (void)simulation.step(false, one(play.take()));
    (void)simulation.step(false, {});
    EXPECT_EQ(placeOf(simulation.scene(), "/crane").y(), 0);
}

TEST(Simulation, OfTwoWhoWantTheSameNodeTheLaterArrivalWins) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    std::vector<Edit> edits = one(moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(1, 0, 0)), 1);
    edits.push_back({.ticket = 2, .list = moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(2, 0, 0))});
    (void)simulation.step(false, std::move(edits));
    EXPECT_EQ(placeOf(simulation.scene(), "/wall"), Vec3d(2, 0, 0));
}

TEST(Simulation, ARefusedEditChangesNothingAndTheOthersGoThrough) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    ChangeListBuilder bad;
    bad.destroy(findNode(simulation.scene(), "/wall").value());  // has a child
    std::vector<Edit> edits = one(bad.take(), 1);
    edits.push_back({.ticket = 2, .list = moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(7, 0, 0))});
    const FrameResult frame = simulation.step(false, std::move(edits));
    EXPECT_FALSE(frame.outcomes[0].result);
    EXPECT_TRUE(frame.outcomes[1].result);
    EXPECT_EQ(placeOf(simulation.scene(), "/wall"), Vec3d(7, 0, 0));
}

TEST(Simulation, AGeometryWithAnIndexPastItsVerticesIsRefusedAndLeavesNoTrace) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    ChangeListBuilder bad;
    const std::uint32_t wild[3] = {0, 1, 1'000'000};
    bad.set(simulation.scene().get<Node>(findNode(simulation.scene(), "/wall/bricks").value())->core,
            typeOf<Geometry>(), fieldId<&Geometry::indices>, Blob::of(std::span<const std::uint32_t>(wild)));
    // The crane's motion moves on in every frame: pause it to compare hashes.
    ChangeListBuilder pause;
    pause.set(simulation.scene().get<Node>(findNode(simulation.scene(), "/motion").value())->core, typeOf<Motion>(),
              fieldId<&Motion::playing>, false);
    (void)simulation.step(false, one(pause.take()));
    const StateHash paused = simulation.scene().stateHash();
    const FrameResult frame = simulation.step(false, one(bad.take()));
    ASSERT_FALSE(frame.outcomes[0].result);
    EXPECT_WORDS(frame.outcomes[0].result.error().message);
    EXPECT_EQ(simulation.scene().stateHash(), paused);
}

TEST(Simulation, UndoTakesBackMovesAndRemovalsInReverseOrder) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(9, 0, 0))));
    ChangeListBuilder remove;
    const ObjectId bricks = findNode(simulation.scene(), "/wall/bricks").value();
    remove.detach(bricks);
    remove.destroy(bricks);
    (void)simulation.step(false, one(remove.take()));
    EXPECT_FALSE(findNode(simulation.scene(), "/wall/bricks"));
    EXPECT_TRUE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
    EXPECT_EQ(findNode(simulation.scene(), "/wall/bricks").value(), bricks);
    EXPECT_EQ(placeOf(simulation.scene(), "/wall").x(), 9);
    EXPECT_TRUE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
    EXPECT_EQ(placeOf(simulation.scene(), "/wall").x(), 4);
    const FrameResult none = simulation.step(false, one(Edit::Kind::kUndo));
    EXPECT_FALSE(none.outcomes.front().result);
}

TEST(Simulation, UndoOfAMoveGivesTheNodeBackToItsMotion) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/crane"), Vec3d(0, 5, 0))));
    (void)simulation.step(false, one(Edit::Kind::kUndo));
    (void)simulation.step(false, {});
    EXPECT_EQ(placeOf(simulation.scene(), "/crane").y(), 0);
    EXPECT_GT(placeOf(simulation.scene(), "/crane").x(), 0);
}

TEST(Simulation, AProposalsPlaceholdersBecomeIdsThatItLearns) {
    Simulation simulation = loaded(craneScene(false));
    (void)simulation.step(true, {});
    ListMaker make;
    make.node("lamp", kRootNode, make.transform(Vec3d(1, 2, 3)));
    const FrameResult frame = simulation.step(false, one(make.builder.take()));
    ASSERT_TRUE(frame.outcomes.front().result);
    ASSERT_EQ(frame.outcomes.front().result->ids.size(), 2u);
    EXPECT_EQ(placeOf(simulation.scene(), "/lamp"), Vec3d(1, 2, 3));
    EXPECT_EQ(findNode(simulation.scene(), "/lamp").value(), frame.outcomes.front().result->ids[1].second);
}

TEST(Simulation, AProposalMayNotChooseItsIds) {
    Simulation simulation = loaded(craneScene(false));
    ChangeListBuilder builder;
    builder.create(ObjectId{5000}, typeOf<Group>());
    const FrameResult frame = simulation.step(true, one(builder.take()));
    ASSERT_FALSE(frame.outcomes.front().result);
    EXPECT_WORDS(frame.outcomes.front().result.error().message);
}

TEST(Simulation, ANonFiniteMoveIsRefusedInWords) {
    Simulation simulation = loaded(craneScene(false));
    const FrameResult frame = simulation.step(true, one(moveTo(transformAt(simulation.scene(), "/wall"),
                                                               Vec3d(std::numeric_limits<double>::quiet_NaN(), 0, 0))));
    ASSERT_FALSE(frame.outcomes.front().result);
    EXPECT_EQ(placeOf(simulation.scene(), "/wall").x(), 4);
}

TEST(Simulation, AnUndoThatMovesNothingIsAppliedAsItLiesThere) {
    Simulation simulation = loaded(craneScene(false));
    ChangeListBuilder pause;  // the crane's motion would share the frame with the undo
    pause.set(simulation.scene().get<Node>(findNode(simulation.scene(), "/motion").value())->core, typeOf<Motion>(),
              fieldId<&Motion::playing>, false);
    std::vector<Edit> quiet = one(pause.take());
    quiet.front().undoable = false;
    EXPECT_TRUE(simulation.step(true, std::move(quiet)).outcomes.front().result);
    EXPECT_EQ(simulation.history().undoDepth(), 0u) << "what nobody can take back leaves nothing on the stack";
    ListMaker make;
    make.node("lamp", kRootNode);
    (void)simulation.step(false, one(make.builder.take()));
    const ChangeListPtr inverse = simulation.listOf(Edit::Kind::kUndo);
    const FrameResult frame = simulation.step(false, one(Edit::Kind::kUndo));
    ASSERT_TRUE(frame.outcomes.front().result);
    EXPECT_FALSE(findNode(simulation.scene(), "/lamp"));
    EXPECT_EQ(frame.commit.list, inverse) << "from the history to the wire without a copy";
}

TEST(Simulation, AFrameInWhichNothingHappensChecksAndSendsNothing) {
    ListMaker make;
    for (int i = 0; i < 50; ++i) {
        const ObjectId motion = make.motion(make.transform(Vec3d::Zero()), {{0, 0, 0, 0}, {1, 6, 0, 0}});
        make.builder.set(motion, typeOf<Motion>(), fieldId<&Motion::playing>, false);
        make.node("motion", kRootNode, motion);
    }
    Simulation simulation = loaded(make.builder.take());
    const std::uint64_t checked = simulation.motions().keysChecked();
    EXPECT_EQ(checked, 50u);
    for (int frame = 0; frame < 20; ++frame) {
        const FrameResult made = simulation.step(frame == 0, {});
        EXPECT_EQ(made.commit.list, nullptr);
        EXPECT_TRUE(made.collision.accepted.empty());
    }
    EXPECT_EQ(simulation.motions().keysChecked(), checked);
    EXPECT_EQ(simulation.motions().playingCount(), 0u);
}

/// The same edits in the same frames: the replica that applies the frames' lists has the server's hash after each.
TEST(Simulation, ReplicasThatApplyEachFramesListFollowExactly) {
    Simulation simulation = loaded(craneScene());
    Aspect replica;
    ASSERT_TRUE(replica.apply(snapshot(simulation.scene())));
    BlobStore blobs;
    for (int i = 0; i < 90; ++i) {
        std::vector<Edit> edits;
        if (i == 10) edits = one(moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(5, 0, 0)));
        if (i == 20) edits = one(Edit::Kind::kUndo);
        if (i == 30) {
            ListMaker make;
            make.node("lamp", findNode(simulation.scene(), "/crane").value(), make.transform(Vec3d(1, 2, 3)));
            edits = one(make.builder.take());
        }
        const FrameResult frame = simulation.step(i == 0, std::move(edits));
        if (frame.commit.list) {
            const Expected<ChangeList> decoded = decodeChangeList(frame.commit.sent->encoded, blobs);
            ASSERT_TRUE(decoded) << decoded.error().message;
            ASSERT_TRUE(replica.apply(*decoded));
        }
        ASSERT_EQ(replica.stateHash(), frame.commit.sent->stateHash) << "frame " << i;
    }
}

}  // namespace
}  // namespace tessera
