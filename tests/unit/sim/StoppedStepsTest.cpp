/// Undo and collisions: a step is what remained of an edit, and what nothing remained of is none.
#include <gtest/gtest.h>

#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::moveTo;
using test::one;
using test::placeOf;
using test::transformAt;

/// The crane stands at the wall: it was led there by hand, which is the first step.
struct CraneAtTheWall {
    CraneAtTheWall() {
        EXPECT_TRUE(simulation.load({test::craneScene()}));
        (void)simulation.step(true, {});
        crane = transformAt(simulation.scene(), "/crane");
        craneNode = findNode(simulation.scene(), "/crane").value();
        wall = findNode(simulation.scene(), "/wall").value();
        first = simulation.scene().stateHash();
        (void)simulation.step(false, one(moveTo(crane, Vec3d(20, 0, 0))));
        there = simulation.scene().stateHash();
        EXPECT_EQ(undo(), 1u);
    }
    [[nodiscard]] std::size_t undo() const { return simulation.history().undoDepth(); }
    [[nodiscard]] std::size_t redo() const { return simulation.history().redoDepth(); }
    [[nodiscard]] StateHash hash() const { return simulation.scene().stateHash(); }
    EditOutcome edit(ChangeList list, Gesture gesture = {}) {
        return simulation.step(false, one(std::move(list), gesture)).outcomes.front();
    }
    EditOutcome go(Edit::Kind kind) { return simulation.step(false, one(kind)).outcomes.front(); }
    void rename(const std::string& name) {
        ChangeListBuilder list;
        setField<&Node::name>(list, wall, name);
        EXPECT_TRUE(edit(list.take()).result);
    }

    Simulation simulation;
    ObjectId crane, wall;
    ObjectId craneNode;  ///< whose core `crane` is
    StateHash first, there;
};

TEST(StoppedSteps, AMoveThatGetsNowhereIsNoStep) {
    CraneAtTheWall show;
    const EditOutcome outcome = show.edit(moveTo(show.crane, Vec3d(20, 0, 0)));
    ASSERT_TRUE(outcome.result);
    EXPECT_EQ(outcome.result->stopped, std::vector{show.crane});
    EXPECT_EQ(show.hash(), show.there);
    EXPECT_EQ(show.undo(), 1u);
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    EXPECT_EQ(show.hash(), show.first) << "what undo takes back is the move that got somewhere";
}

TEST(StoppedSteps, ASizeOfNothingIsStoppedAndNoStep) {
    CraneAtTheWall show;
    ChangeListBuilder list;
    setField<&Transform::scale>(list, show.crane, Vec3d::Zero());
    EXPECT_EQ(show.edit(list.take()).result->stopped, std::vector{show.crane});
    EXPECT_EQ(show.undo(), 1u);
    EXPECT_EQ(show.hash(), show.there);
}

TEST(StoppedSteps, WhatWasTakenBackCanStillBeDoneAgain) {
    CraneAtTheWall show;
    show.rename("bricks and mortar");
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    ASSERT_EQ(show.redo(), 1u);
    (void)show.edit(moveTo(show.crane, Vec3d(20, 0, 0)));
    show.rename("wall");  // as it is called already
    EXPECT_EQ(show.redo(), 1u);
    EXPECT_EQ(show.undo(), 1u);
    ASSERT_TRUE(show.go(Edit::Kind::kRedo).result);
    EXPECT_EQ(show.simulation.scene().get<Node>(show.wall)->name, "bricks and mortar");
}

ChangeList placed(ObjectId node, ObjectId parent, std::uint32_t index = Placement::kLast) {
    ChangeListBuilder list;
    list.place(node, parent, index);
    return list.take();
}

TEST(StoppedSteps, ANodeThatIsPutWhereItStandsIsNoStep) {
    CraneAtTheWall show;
    show.rename("bricks and mortar");
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    const ObjectId last = show.simulation.scene().root().children.back();
    for (const ChangeList& same :
         {placed(show.craneNode, kRootNode, 0), placed(show.wall, kRootNode, 1), placed(last, kRootNode)}) {
        ASSERT_TRUE(show.edit(same).result);
        EXPECT_EQ(show.undo(), 1u);
        EXPECT_EQ(show.redo(), 1u) << "what was taken back can still be done again";
    }
    ASSERT_TRUE(show.edit(placed(show.craneNode, kRootNode, 1)).result);
    EXPECT_EQ(show.undo(), 2u) << "among its siblings it stands elsewhere";
    EXPECT_EQ(show.redo(), 0u);
}

TEST(StoppedSteps, AGestureThatPutsANodeBackToItsPlaceIsNone) {
    CraneAtTheWall show;
    const Gesture gesture{1, 7};
    ASSERT_TRUE(show.edit(placed(show.craneNode, show.wall), gesture).result);
    ASSERT_TRUE(show.edit(placed(show.craneNode, kRootNode, 2), gesture).result);
    EXPECT_EQ(show.undo(), 2u) << "behind its old place";
    ASSERT_TRUE(show.edit(placed(show.craneNode, kRootNode, 0), gesture).result);
    EXPECT_EQ(show.undo(), 1u);
    EXPECT_EQ(show.hash(), show.there);
}

/// Where it was stopped is where redo leads, and where it began is where undo leads.
TEST(StoppedSteps, AMoveThatGetsPartOfItsWayIsAStepOfThatPart) {
    CraneAtTheWall show;
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    EXPECT_EQ(show.hash(), show.first);
    ASSERT_TRUE(show.go(Edit::Kind::kRedo).result);
    EXPECT_EQ(show.hash(), show.there);
}

TEST(StoppedSteps, OfSeveralPartsTheStepHoldsThoseThatRemained) {
    CraneAtTheWall show;
    ChangeListBuilder list;
    setField<&Transform::translation>(list, show.crane, Vec3d(20, 0, 0));
    setField<&Node::name>(list, show.wall, std::string("in the way"));
    EXPECT_EQ(show.edit(list.take()).result->stopped, std::vector{show.crane});
    EXPECT_EQ(show.undo(), 2u);
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    EXPECT_EQ(show.hash(), show.there);
    EXPECT_EQ(show.simulation.scene().get<Node>(show.wall)->name, "wall");
    // A hand that is stopped has paused the motion all the same.
    const ObjectId motion =
        show.simulation.scene().get<Node>(findNode(show.simulation.scene(), "/motion").value())->core;
    ChangeListBuilder play;
    setField<&Motion::playing>(play, motion, true);
    (void)show.edit(play.take());
    EXPECT_EQ(show.undo(), 2u);
    (void)show.edit(moveTo(show.crane, Vec3d(20, 0, 0)));
    EXPECT_EQ(show.undo(), 3u);
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    EXPECT_TRUE(show.simulation.scene().get<Motion>(motion)->playing);
}

TEST(StoppedSteps, ADragAgainstAWallIsAStepOnceItGetsAway) {
    CraneAtTheWall show;
    for (int i = 0; i < 5; ++i) (void)show.edit(moveTo(show.crane, Vec3d(20 + i, 0, 0)), {7, 1});
    EXPECT_EQ(show.undo(), 1u);
    (void)show.edit(moveTo(show.crane, Vec3d(1, 0, 0)), {7, 1});
    for (int i = 0; i < 5; ++i) (void)show.edit(moveTo(show.crane, Vec3d(20 + i, 0, 0)), {7, 1});
    (void)show.edit(moveTo(show.crane, Vec3d(2, 0, 0)), {7, 1});
    EXPECT_EQ(show.undo(), 2u);
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    EXPECT_EQ(show.hash(), show.there);
}

TEST(StoppedSteps, OfTwoEditsOfAFrameTheOneThatWasOverruledIsNoStep) {
    CraneAtTheWall show;
    std::vector<Edit> edits = one(moveTo(show.crane, Vec3d(1, 0, 0)), 1);
    edits.push_back({.ticket = 2, .list = moveTo(show.crane, Vec3d(2, 0, 0))});
    (void)show.simulation.step(false, std::move(edits));
    EXPECT_EQ(placeOf(show.simulation.scene(), "/crane").x(), 2);
    EXPECT_EQ(show.undo(), 2u);
    ASSERT_TRUE(show.go(Edit::Kind::kUndo).result);
    EXPECT_EQ(show.hash(), show.there);
}

/// Boxes in a row that stop each other, edited at random, some edits of a frame together.
TEST(StoppedSteps, EachStepTakesSomethingBack) {
    forSeeds(100, [](Random& random) {
        test::ListMaker make;
        std::vector<ObjectId> nodes;
        for (int i = 0; i < 4; ++i) {
            nodes.push_back(make.node("thing", kRootNode, make.transform(Vec3d(2 * i, 0, 0))));
            make.node("box", nodes.back(), make.box(Vec3d::Ones()));
            const ObjectId interest = make.create<Interest>();
            setField<&Interest::object>(make.builder, interest, nodes.back());
            make.node("interest", kRootNode, interest);
        }
        Simulation simulation;
        ASSERT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
        std::vector<ObjectId> things, cores;
        for (const ObjectId child : simulation.scene().root().children)
            if (const Node* node = simulation.scene().get<Node>(child); simulation.scene().coreOf<Transform>(*node)) {
                things.push_back(child);
                cores.push_back(node->core);
            }
        for (int i = 0; i < 40; ++i) {
            const StateHash before = simulation.scene().stateHash();
            const std::size_t undo = simulation.history().undoDepth(), redo = simulation.history().redoDepth();
            if (oneIn(random, 4)) {
                const bool back = oneIn(random, 2);
                const FrameResult frame = simulation.step(false, one(back ? Edit::Kind::kUndo : Edit::Kind::kRedo));
                const EditOutcome& outcome = frame.outcomes.front();
                ASSERT_EQ(outcome.result.has_value(), (back ? undo : redo) > 0);
                if (!outcome.result) continue;
                ASSERT_TRUE(outcome.result->stopped.empty());
                ASSERT_NE(simulation.scene().stateHash(), before) << "a step that does nothing";
                continue;
            }
            std::vector<Edit> edits;
            for (std::size_t k = 1 + below(random, 3); k > 0; --k) {
                ChangeListBuilder list;
                for (std::size_t parts = 1 + below(random, 2); parts > 0; --parts) {
                    const std::size_t which = below(random, cores.size());
                    switch (below(random, 5)) {
                        case 0:
                            setField<&Node::name>(list, things[which],
                                                  std::string(oneIn(random, 2) ? "thing" : "other"));
                            break;
                        case 1:
                            setField<&Transform::scale>(list, cores[which],
                                                        Vec3d(Vec3d::Constant(static_cast<double>(below(random, 2)))));
                            break;
                        default:
                            setField<&Transform::translation>(list, cores[which],
                                                              Vec3d(static_cast<double>(below(random, 8)), 0, 0));
                    }
                }
                edits.push_back({.ticket = k, .list = list.take(), .gesture = {1, below(random, 3)}});
            }
            const std::size_t many = edits.size();
            (void)simulation.step(false, std::move(edits));
            const std::size_t now = simulation.history().undoDepth();
            if (simulation.scene().stateHash() == before) {
                // Two edits of a frame may have undone each other; one may not.
                if (many > 1) continue;
                ASSERT_EQ(now, undo) << "a step of nothing";
                ASSERT_EQ(simulation.history().redoDepth(), redo);
            } else {
                ASSERT_LE(now, undo + many);
                ASSERT_GE(now + many, undo) << "a gesture that has come back is none";
                ASSERT_EQ(simulation.history().redoDepth(), 0u);
            }
        }
    });
}

}  // namespace
}  // namespace tessera
