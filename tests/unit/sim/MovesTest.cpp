/// Moves that the server works out: those of one frame add up, are stopped together, and are taken back one by one.
#include <gtest/gtest.h>

#include <optional>

#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::moveTo;
using test::one;
using test::placeOf;
using test::transformAt;

Edit moveBy(std::uint64_t ticket, ObjectId node, const Vec3d& by, Gesture gesture = {}) {
    return {.ticket = ticket, .gesture = gesture, .move = NodeMove{.translation = by, .relative = true}, .node = node};
}

struct Yard {
    explicit Yard(bool plays = false) {
        EXPECT_TRUE(simulation.load({test::craneScene()}));
        ChangeListBuilder rest;  // pausing it would be a part of the first step
        setField<&Motion::playing>(rest, transformAt(simulation.scene(), "/motion"), plays);
        (void)simulation.step(true, one(Edit{.list = rest.take(), .undoable = false}));
        crane = findNode(simulation.scene(), "/crane").value();
        hook = findNode(simulation.scene(), "/crane/hook").value();
        place = transformAt(simulation.scene(), "/crane");
    }
    [[nodiscard]] double x() const { return placeOf(simulation.scene(), "/crane").x(); }
    [[nodiscard]] std::size_t undo() const { return simulation.history().undoDepth(); }
    FrameResult step(std::vector<Edit> edits) { return simulation.step(false, std::move(edits)); }
    Expected<answer::Committed> go(Edit::Kind kind) { return step(one(kind)).outcomes.front().result; }

    Simulation simulation;
    ObjectId crane, hook, place;
};

TEST(Moves, OfAFrameAddUpAndEachIsTakenBackByItself) {
    Yard yard;
    std::vector<Edit> edits;
    for (std::uint64_t i = 1; i <= 4; ++i) edits.push_back(moveBy(i, i % 2 ? yard.crane : yard.hook, Vec3d(0.5, 0, 0)));
    edits.push_back(moveBy(5, yard.crane, Vec3d(-0.25, 0, 0)));
    const FrameResult frame = yard.step(std::move(edits));
    ASSERT_EQ(frame.outcomes.size(), 5u);
    for (const EditOutcome& outcome : frame.outcomes) {
        EXPECT_TRUE(outcome.result);
        EXPECT_TRUE(outcome.result->stopped.empty());
    }
    const std::vector<double> ways{0, 0.5, 1, 1.5, 2, 1.75};
    EXPECT_EQ(yard.x(), ways.back());
    ASSERT_EQ(yard.undo(), 5u);
    for (std::size_t i = 5; i-- > 0;) {
        ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
        EXPECT_EQ(yard.x(), ways[i]);
    }
    for (std::size_t i = 1; i <= 5; ++i) {
        ASSERT_TRUE(yard.go(Edit::Kind::kRedo));
        EXPECT_EQ(yard.x(), ways[i]);
    }
}

/// Nobody can say then how far each of them got: all are told, and one step takes it back.
TEST(Moves, ThatTheWallStopsAreStoppedTogether) {
    Yard yard;
    std::vector<Edit> edits;
    for (std::uint64_t i = 1; i <= 4; ++i) edits.push_back(moveBy(i, yard.crane, Vec3d(1, 0, 0)));
    const FrameResult frame = yard.step(std::move(edits));
    for (const EditOutcome& outcome : frame.outcomes)
        EXPECT_EQ(outcome.result->stopped, std::vector{yard.place}) << outcome.ticket;
    EXPECT_LT(yard.x(), 3);
    EXPECT_GT(yard.x(), 2.9);
    EXPECT_EQ(yard.undo(), 1u);
    ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
    EXPECT_EQ(yard.x(), 0);
}

TEST(Moves, GoOnFromWhereAnEditOfTheSameFrameLeadsAndAPlaceOverrulesThem) {
    Yard yard;
    std::vector<Edit> edits = one(moveBy(1, yard.crane, Vec3d(0.5, 0, 0)));
    edits.push_back({.ticket = 2, .list = moveTo(yard.place, Vec3d(1, 0, 0))});
    edits.push_back(moveBy(3, yard.crane, Vec3d(0.5, 0, 0)));
    edits.push_back({.ticket = 4, .move = NodeMove{.scale = Vec3d(2, 2, 2), .relative = true}, .node = yard.crane});
    (void)yard.step(std::move(edits));
    EXPECT_EQ(yard.x(), 1.5);
    ASSERT_EQ(yard.undo(), 3u) << "the first has been overruled";
    ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
    EXPECT_EQ(yard.simulation.scene().get<Transform>(yard.place)->scale, Vec3d::Ones());
    EXPECT_EQ(yard.x(), 1.5);
    ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
    EXPECT_EQ(yard.x(), 1);
    ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
    EXPECT_EQ(yard.x(), 0);

    edits = one(moveBy(1, yard.crane, Vec3d(0.5, 0, 0)));
    edits.push_back({.ticket = 2, .move = NodeMove{.translation = Vec3d(1, 0, 0)}, .node = yard.crane});
    (void)yard.step(std::move(edits));
    EXPECT_EQ(yard.x(), 1);
    ASSERT_EQ(yard.undo(), 1u);
    ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
    EXPECT_EQ(yard.x(), 0);
}

TEST(Moves, OfOneGestureAreOneStep) {
    Yard yard;
    for (int i = 0; i < 3; ++i) {
        std::vector<Edit> edits;
        for (std::uint64_t k = 1; k <= 2; ++k) edits.push_back(moveBy(k, yard.crane, Vec3d(0.25, 0, 0), {7, 1}));
        (void)yard.step(std::move(edits));
    }
    EXPECT_EQ(yard.x(), 1.5);
    EXPECT_EQ(yard.undo(), 1u);
    ASSERT_TRUE(yard.go(Edit::Kind::kUndo));
    EXPECT_EQ(yard.x(), 0);
}

TEST(Moves, BeginWhereAMotionHasLedAndPauseIt) {
    Yard yard(true);
    for (int i = 0; i < 12; ++i) (void)yard.step({});
    const double there = yard.x();
    ASSERT_GT(there, 0);
    std::vector<Edit> edits = one(moveBy(1, yard.crane, Vec3d(0, 1, 0)));
    edits.push_back(moveBy(2, yard.crane, Vec3d(0, 1, 0)));
    (void)yard.step(std::move(edits));
    (void)yard.step({});
    EXPECT_EQ(placeOf(yard.simulation.scene(), "/crane"), Vec3d(there, 2, 0));
}

TEST(Moves, OfWhatCannotBeMovedAreRefusedInWordsAndTheOthersGoOn) {
    Yard yard;
    std::vector<Edit> edits = one(moveBy(1, ObjectId(4711), Vec3d::Ones()));
    edits.push_back(moveBy(2, findNode(yard.simulation.scene(), "/interest").value(), Vec3d::Ones()));
    edits.push_back({.ticket = 3, .move = NodeMove{.scale = Vec3d(1, 0, 1), .relative = true}, .node = yard.crane});
    edits.push_back({.ticket = 4, .move = NodeMove{}, .node = yard.crane});
    edits.push_back(moveBy(5, yard.crane, Vec3d(1, 0, 0)));
    const FrameResult frame = yard.step(std::move(edits));
    for (std::size_t i = 0; i < 4; ++i) {
        ASSERT_FALSE(frame.outcomes[i].result) << i;
        EXPECT_WORDS(frame.outcomes[i].result.error().message);
    }
    EXPECT_TRUE(frame.outcomes[4].result);
    EXPECT_EQ(yard.x(), 1);
    EXPECT_EQ(yard.undo(), 1u);
}

/// Where nothing is in the way: the ways are the sum, whoever moves what in which frame, and undo leads back through
/// it.
TEST(Moves, OfAnyHistoryAreTheirSum) {
    forSeeds(200, [](Random& random) {
        test::ListMaker make;
        for (int i = 0; i < 3; ++i) {
            const ObjectId node = make.node("n" + std::to_string(i), kRootNode, make.transform(Vec3d::Zero()));
            make.node("box", node, make.box(Vec3d::Ones()));
        }
        Simulation simulation;
        ASSERT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
        std::vector<ObjectId> nodes, cores;
        for (int i = 0; i < 3; ++i) {
            nodes.push_back(findNode(simulation.scene(), "/n" + std::to_string(i)).value());
            cores.push_back(simulation.scene().get<Node>(nodes.back())->core);
        }
        using State = std::array<Vec3d, 3>;
        const auto stateNow = [&] {
            State state;
            for (std::size_t i = 0; i < 3; ++i) state[i] = simulation.scene().get<Transform>(cores[i])->translation;
            return state;
        };
        State expected = stateNow();
        std::vector<State> before;  // each step that says something
        for (int frame = 0; frame < 20; ++frame) {
            std::vector<Edit> edits;
            std::array<bool, 3> placed{};
            for (std::size_t k = below(random, 6); k > 0; --k) {
                const std::size_t which = below(random, 3);
                const Vec3d by(static_cast<double>(below(random, 5)) - 2, static_cast<double>(below(random, 3)) - 1, 0);
                // A place overrules what was before it in the frame: only where nothing was.
                const bool place = oneIn(random, 5) && !placed[which] &&
                                   std::ranges::none_of(
                                       edits, [&](const Edit& edit) { return edit.move && edit.node == nodes[which]; });
                placed[which] = placed[which] || place;
                const State from = expected;
                if (place) {
                    expected[which] = by;
                    oneIn(random, 2)
                        ? edits.push_back({.ticket = k, .list = moveTo(cores[which], by)})
                        : edits.push_back({.ticket = k, .move = NodeMove{.translation = by}, .node = nodes[which]});
                } else {
                    expected[which] += by;
                    edits.push_back(moveBy(k, nodes[which], by));
                }
                if (expected != from) before.push_back(from);
            }
            (void)simulation.step(false, std::move(edits));
            ASSERT_EQ(stateNow(), expected) << "frame " << frame;
        }
        ASSERT_EQ(simulation.history().undoDepth(), before.size());
        // Within a frame the steps come in the order of the edits: each state is one that the fold went through.
        for (std::size_t i = before.size(); i-- > 0;) {
            ASSERT_TRUE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
            ASSERT_EQ(stateNow(), before[i]) << "step " << i;
        }
    });
}

}  // namespace
}  // namespace tessera
