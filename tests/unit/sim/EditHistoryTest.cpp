/// Undo and redo: every state of a history is reached again, in steps as they were made, within bounds.
#include "server/sim/commit/EditHistory.h"

#include <gtest/gtest.h>

#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::one;
/// A few nodes with transforms and names, edited at random.
class Show {
public:
    explicit Show(Random& random) : random_(random) {
        test::ListMaker make;
        for (int i = 0; i < 4; ++i) make.node("node", kRootNode, make.transform(Vec3d(i, 0, 0)));
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
    }
    /// False where it was refused.
    bool edit(Gesture gesture) {
        test::ListMaker make;
        const auto any = [&](ObjectType type) {
            std::vector<ObjectId> all;
            for (const ObjectId id : simulation.scene().ids())
                if (id != kRootNode && typeOf(simulation.scene().find(id)) == type) all.push_back(id);
            return all.empty() ? ObjectId{} : all[below(random_, all.size())];
        };
        switch (below(random_, 5)) {
            case 0:
                make.node("new", kRootNode, make.transform(Vec3d(1, 2, 3)));
                break;
            case 1: {
                const ObjectId node = any(typeOf<Node>());
                make.builder.detach(node);
                make.builder.destroy(node);
                break;
            }
            case 2:
                setField<&Node::name>(make.builder, any(typeOf<Node>()), std::to_string(random_()));
                break;
            default:
                setField<&Transform::translation>(make.builder, any(typeOf<Transform>()),
                                                  Vec3d(static_cast<double>(below(random_, 100)), 0, 0));
        }
        return simulation.step(false, one(make.builder.take(), gesture)).outcomes.front().result.has_value();
    }
    bool go(Edit::Kind kind) { return simulation.step(false, one(kind)).outcomes.front().result.has_value(); }

    Simulation simulation;

private:
    Random& random_;
};

TEST(EditHistory, EveryStateIsReachedAgainInBothDirections) {
    forSeeds(150, [](Random& random) {
        Show show(random);
        std::vector<StateHash> states{show.simulation.scene().stateHash()};  // after each step
        std::size_t at = 0;
        Gesture open;  // of the newest step, while edits join it
        for (int i = 0; i < 60; ++i) {
            const std::size_t what = below(random, 6);
            if (what < 2) {
                const bool undo = what == 0, possible = undo ? at > 0 : at + 1 < states.size();
                ASSERT_EQ(show.go(undo ? Edit::Kind::kUndo : Edit::Kind::kRedo), possible);
                if (!possible) continue;
                at += undo ? std::size_t(-1) : 1;
                open = {};
                ASSERT_EQ(show.simulation.scene().stateHash(), states[at]);
            } else {
                const Gesture gesture{1, below(random, 3)};
                if (!show.edit(gesture)) continue;
                // What is so already is no step.
                if (show.simulation.scene().stateHash() == states[at]) continue;
                states.resize(at + 1);
                if (gesture.id == 0 || gesture != open) {
                    states.push_back({});
                    ++at;
                }
                open = gesture.id == 0 ? Gesture{} : gesture;
                states[at] = show.simulation.scene().stateHash();
            }
            ASSERT_EQ(show.simulation.history().undoDepth(), at);
            ASSERT_EQ(show.simulation.history().redoDepth(), states.size() - 1 - at);
        }
        while (at > 0) {
            ASSERT_TRUE(show.go(Edit::Kind::kUndo));
            ASSERT_EQ(show.simulation.scene().stateHash(), states[--at]);
        }
    });
}

TEST(EditHistory, ADragIsOneStepAndHoldsNoMoreThanOneOfItsEdits) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({test::craneScene(false)}));
    (void)simulation.step(true, {});
    const ObjectId wall = test::transformAt(simulation.scene(), "/wall");
    std::uint64_t first = 0;
    for (int i = 1; i <= 600; ++i) {
        (void)simulation.step(false, one(test::moveTo(wall, Vec3d(4 + 0.01 * i, 0, 0)), {7, 1}));
        if (i == 1) first = simulation.history().bytes();
    }
    EXPECT_EQ(simulation.history().undoDepth(), 1u);
    EXPECT_EQ(simulation.history().bytes(), first);
    (void)simulation.step(false, one(test::moveTo(wall, Vec3d(1, 1, 1)), {8, 1}));
    EXPECT_EQ(simulation.history().undoDepth(), 2u) << "a gesture of somebody else";
    (void)simulation.step(false, one(Edit::Kind::kUndo));
    EXPECT_NEAR(test::placeOf(simulation.scene(), "/wall").x(), 10, 1e-12);
    (void)simulation.step(false, one(Edit::Kind::kUndo));
    EXPECT_EQ(test::placeOf(simulation.scene(), "/wall").x(), 4);
    (void)simulation.step(false, one(Edit::Kind::kRedo));
    EXPECT_NEAR(test::placeOf(simulation.scene(), "/wall").x(), 10, 1e-12);
}

ChangeList named(std::size_t bytes) {
    ChangeListBuilder list;
    setField<&Geometry::positions>(list, ObjectId(2), Blob(Bytes(bytes)));
    return list.take();
}

TEST(EditHistory, IsBoundedInStepsAndInBytesAndKeepsTheNewest) {
    EditHistory history({.steps = 4, .bytes = 10'000});
    for (int i = 0; i < 10; ++i) history.edited(named(100));
    EXPECT_EQ(history.undoDepth(), 4u);
    for (std::size_t i = 0; i < 10; ++i) history.edited(named(4000 + i));
    EXPECT_EQ(history.undoDepth(), 2u);
    EXPECT_LE(history.bytes(), 10'000u);
    history.edited(named(1'000'000));
    EXPECT_EQ(history.undoDepth(), 1u) << "the newest stays";
    history.undone(named(2'000'000));
    EXPECT_EQ(history.undoDepth(), 0u);
    EXPECT_EQ(history.redoDepth(), 1u);
    history.edited({});
    EXPECT_EQ(history.redoDepth(), 0u) << "after another change nothing can be done again";
    EXPECT_LT(history.bytes(), 1000u);
}

TEST(EditHistory, CountsTheBytesThatRangesLeadBackTo) {
    EditHistory history({.steps = 100, .bytes = 10'000});
    for (std::size_t i = 0; i < 10; ++i) {
        ChangeListBuilder list;
        list.setRange(ObjectId(7), typeOf<Geometry>(), fieldId<&Geometry::positions>, 0, Blob(Bytes(4000 + i)));
        history.edited(list.take());
    }
    EXPECT_EQ(history.undoDepth(), 2u);
    EXPECT_LE(history.bytes(), 10'000u);
}

}  // namespace
}  // namespace tessera
