/// A load in parts: bounded, hidden until the last, one step, taken away where it cannot be finished.
#include "server/sim/frame/LoadParts.h"

#include <gtest/gtest.h>

#include "common/cores/CollisionObject.h"
#include "common/cores/Environment.h"
#include "common/cores/Interest.h"
#include "common/cores/ParticleEmitter.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/view/LevelChoice.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::one;
constexpr LoadPartLimits kSmall{.changes = 50, .bytes = 4096};

/// A tree of `count` nodes with transforms, some of which are placed before what they hang below is created, with
/// motions, and with collision objects that name nodes which come later.
ChangeList forest(Random& random, std::size_t count, ObjectId parent = kRootNode) {
    test::ListMaker make;
    std::vector<ObjectId> nodes, open;
    for (std::size_t i = 0; i < count; ++i) {
        const ObjectId place = make.transform(Vec3d(static_cast<double>(i), 0, 0));
        const ObjectId node = make.create<Node>();
        setField<&Node::name>(make.builder, node, "n" + std::to_string(i));
        setField<&Node::core>(make.builder, node, place);
        nodes.push_back(node);
    }
    // Parents are any that come before in a shuffled order: children stand before and after their parents.
    std::vector<ObjectId> order = nodes;
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[below(random, i)]);
    for (std::size_t i = 0; i < order.size(); ++i)
        make.builder.place(order[i], i < 3 ? parent : order[below(random, std::min<std::size_t>(i, 20))]);
    for (std::size_t i = 0; i < count / 10; ++i) {
        const ObjectId object = make.create<CollisionObject>();
        setField<&CollisionObject::node>(make.builder, object, nodes[below(random, nodes.size())]);
        make.node("object", order[below(random, 10)], object);
    }
    make.node("motion", order[0], make.motion(make.transform(Vec3d::Zero()), {{0, 0, 0, 0}, {1, 6, 0, 0}}));
    const ObjectId still = make.motion(make.transform(Vec3d::Zero()), {{0, 0, 0, 0}, {1, 6, 0, 0}});
    setField<&Motion::playing>(make.builder, still, false);
    make.node("still", order[1], still);
    const ObjectId stream = make.create<ParticleEmitter>();
    setField<&ParticleEmitter::speed>(make.builder, stream, 1.0);
    make.node("stream", order[2], stream);
    return make.builder.take();
}

/// Whether a list lets the time of an emitter go on.
bool timeSaid(const ChangeList& list) {
    return std::ranges::any_of(list.columns, [](const FieldColumn& column) {
        return column.type == typeOf<ParticleEmitter>() && column.field == fieldId<&ParticleEmitter::time>;
    });
}

/// What a desk does: a part in each frame.
class Loading {
public:
    Loading(ChangeList list, const LoadPartLimits& limits = kSmall, std::uint64_t ticket = 7)
        : objects_(list.creations.size()), parts_(cutForFrames(std::move(list), limits)), ticket_(ticket) {}
    [[nodiscard]] bool done() const { return next_ == parts_.size(); }
    [[nodiscard]] std::size_t count() const { return parts_.size(); }
    [[nodiscard]] Edit next() {
        Edit edit{.ticket = ticket_, .list = std::move(parts_[next_++])};
        edit.kind = done() ? Edit::Kind::kLastPart : Edit::Kind::kPart;
        edit.objects = objects_;
        return edit;
    }
    FrameResult frame(Simulation& simulation) {
        std::vector<Edit> edits;
        edits.push_back(next());
        return simulation.step(false, std::move(edits));
    }

private:
    std::size_t objects_;
    std::vector<ChangeList> parts_;
    std::uint64_t ticket_;
    std::size_t next_ = 0;
};

/// The same scene loaded before the first frame: its hash after as many frames of motion as the load was seen for.
StateHash loadedAtOnce(const ChangeList& list) {
    Simulation simulation;
    EXPECT_TRUE(simulation.load({list}));
    return simulation.scene().stateHash();
}

TEST(LoadParts, AreBoundedHiddenAndMakeTheSameScene) {
    forSeeds(30, [](Random& random) {
        const ChangeList whole = forest(random, 300);
        Simulation simulation;
        Loading loading(whole);
        ASSERT_GT(loading.count(), 5u);
        while (!loading.done()) {
            const std::size_t before = simulation.scene().objectCount();
            const FrameResult result = loading.frame(simulation);
            ASSERT_TRUE(result.outcomes.at(0).result) << result.outcomes.at(0).result.error().message;
            ASSERT_TRUE(result.commit.list);
            if (loading.done()) {
                EXPECT_TRUE(result.commit.list->creations.empty())
                    << "nothing but the placing is left for the last frame";
                EXPECT_EQ(simulation.scene().root().children.size(), 3u);
            } else {
                EXPECT_LE(result.commit.list->changeCount(), kSmall.changes);
                EXPECT_GT(simulation.scene().objectCount(), before);
                EXPECT_EQ(simulation.scene().root().children.size(), 0u) << "it appears whole";
                EXPECT_EQ(simulation.motions().playingCount(), 0u) << "what nobody sees does not go on";
                EXPECT_FALSE(timeSaid(*result.commit.list)) << "nor does a stream";
            }
        }
        EXPECT_EQ(simulation.motions().playingCount(), 1u);
        EXPECT_EQ(simulation.scene().stateHash(), loadedAtOnce(whole));
        EXPECT_EQ(simulation.history().undoDepth(), 1u);
    });
}

/// Motions play, and move nothing: their keys are unsound. Emitters play at no speed.
void standStill(ChangeList& list) {
    for (FieldColumn& column : list.columns)
        if (column.type == typeOf<Motion>() && column.field == fieldId<&Motion::keys>)
            for (Blob& keys : std::get<std::vector<Blob>>(column.values)) keys = Blob();
        else if (column.type == typeOf<ParticleEmitter>() && column.field == fieldId<&ParticleEmitter::speed>)
            for (double& speed : std::get<std::vector<double>>(column.values)) speed = 0;
}

/// A tree of any shape: chains, broad ones, such as grow anywhere; with three tops at most.
ChangeList tree(Random& random, std::size_t count, ObjectId parent = kRootNode) {
    test::ListMaker make;
    std::vector<ObjectId> ids;
    for (std::size_t i = 0; i < count; ++i) {
        ids.push_back(make.create<Node>());
        setField<&Node::name>(make.builder, ids.back(), "n" + std::to_string(i));
    }
    for (std::size_t i = count; i > 1; --i) std::swap(ids[i - 1], ids[below(random, i)]);
    const std::size_t tops = 1 + below(random, 3), shape = below(random, 4);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t above[] = {i % 100 == 0 ? 0 : i - 1, 0, below(random, i),
                                     i - 1 - below(random, std::min<std::size_t>(i, 5))};
        make.builder.place(ids[i], i < tops ? parent : ids[above[shape]]);
    }
    make.node("motion", ids[count / 2], make.motion(make.transform(Vec3d::Zero()), {{0, 0, 0, 0}, {1, 6, 0, 0}}));
    return make.builder.take();
}

/// All nodes that can be seen, in document order.
std::vector<ObjectId> seenNodes(const Aspect& scene) {
    std::vector<ObjectId> seen, open{kRootNode};
    while (!open.empty()) {
        seen.push_back(open.back());
        const ChildList& children = scene.get<Node>(open.back())->children;
        open.pop_back();
        const std::vector<ObjectId> inOrder(children.begin(), children.end());
        open.insert(open.end(), inOrder.rbegin(), inOrder.rend());
    }
    return seen;
}

TEST(LoadParts, AppearAndAreHiddenAFewNodesAtATimeInDocumentOrder) {
    forSeeds(60, [](Random& random) {
        const bool moves = oneIn(random, 2);  // where nothing does states compare
        ChangeList whole = tree(random, 1 + below(random, 300));
        if (!moves) standStill(whole);
        Simulation atOnce, simulation;
        ASSERT_TRUE(atOnce.load({whole}));
        const std::vector<ObjectId> order = seenNodes(atOnce.scene());
        const LoadPartLimits limits{
            .changes = 50, .bytes = 4096, .seen = 1 + below(random, oneIn(random, 2) ? 10 : 100)};
        Aspect replica;
        std::size_t seen = 1;
        const auto look = [&](const FrameResult& result, bool more) {
            if (result.commit.list) {
                ASSERT_TRUE(replica.apply(*result.commit.list));
            }
            ASSERT_EQ(replica.stateHash(), simulation.scene().stateHash());
            const std::vector<ObjectId> now = seenNodes(simulation.scene());
            ASSERT_LE(more ? now.size() - seen : seen - now.size(), limits.seen);
            ASSERT_TRUE(now.size() <= order.size() && std::equal(now.begin(), now.end(), order.begin()))
                << "what is seen has nothing before it that is not";
            seen = now.size();
        };
        Loading loading(whole, limits);
        if (loading.count() == 1) return;
        while (!loading.done()) {
            EXPECT_EQ(simulation.motions().playingCount(), 0u) << "what moves by itself begins together";
            const FrameResult result = loading.frame(simulation);
            ASSERT_TRUE(result.outcomes.at(0).result) << result.outcomes[0].result.error().message;
            EXPECT_EQ(simulation.appearing(), seenNodes(simulation.scene()).size() > 1 && !loading.done());
            look(result, true);
        }
        ASSERT_EQ(seen, order.size());
        EXPECT_EQ(simulation.motions().playingCount(), 1u);
        EXPECT_EQ(simulation.scene().stateHash(), atOnce.scene().stateHash());
        EXPECT_EQ(simulation.history().undoDepth(), 1u);
        for (int round = 0; round < 2; ++round) {
            FrameResult result = simulation.step(false, one(Edit::Kind::kUndo));
            ASSERT_TRUE(result.outcomes.at(0).result);
            look(result, false);
            while (result.outcomes.empty() || result.outcomes[0].underWay) {
                ASSERT_GT(seen, 1u) << "whoever undoes it is told when nobody sees it";
                result = simulation.step(false, {});
                look(result, false);
            }
            EXPECT_TRUE(result.outcomes[0].result);
            EXPECT_EQ(seen, 1u);
            while (simulation.stepUnderWay()) {
                result = simulation.step(false, {});
                EXPECT_TRUE(result.outcomes.empty());
                look(result, false);
            }
            EXPECT_EQ(simulation.scene().objectCount(), 1u);
            result = simulation.step(false, one(Edit::Kind::kRedo));
            look(result, true);
            while (simulation.stepUnderWay()) {
                result = simulation.step(false, {});
                look(result, true);
            }
            ASSERT_TRUE(result.outcomes.at(0).result);
            EXPECT_EQ(seen, order.size());
            EXPECT_EQ(simulation.motions().playingCount(), 1u);
            if (!moves) {
                EXPECT_EQ(simulation.scene().stateHash(), atOnce.scene().stateHash());
            }
            EXPECT_EQ(simulation.history().undoDepth(), 1u);
        }
    });
}

TEST(LoadParts, BodiesFallWhenTheFloorIsThere) {
    test::ListMaker make;
    std::vector<ObjectId> bodies;
    for (int i = 0; i < 20; ++i) {
        const ObjectId body = make.node("body", kRootNode, make.transform(Vec3d(3.0 * i, 0.6, 0)));
        make.node("box", body, make.box(Vec3d::Ones()));
        const ObjectId object = make.create<CollisionObject>();
        setField<&CollisionObject::node>(make.builder, object, body);
        setField<&CollisionObject::mass>(make.builder, object, i % 5 == 4 ? 0.0 : 1.0 + i);
        make.node("object", kRootNode, object);
        const ObjectId interest = make.create<Interest>();
        setField<&Interest::object>(make.builder, interest, body);
        setField<&Interest::response>(make.builder, interest, Interest::kBounce);
        make.node("interest", kRootNode, interest);
    }
    const ObjectId surroundings = make.create<Environment>();
    setField<&Environment::gravity>(make.builder, surroundings, Vec3d(0, -9.81, 0));
    make.node("surroundings", kRootNode, surroundings);
    make.node("floor", make.node("ground", kRootNode, make.transform(Vec3d(30, -0.5, 0))), make.box(Vec3d(100, 1, 10)));
    const ChangeList whole = make.builder.take();
    Simulation atOnce, few;
    for (auto& [simulation, seen] : {std::pair(&atOnce, std::size_t{1000}), std::pair(&few, std::size_t{2})}) {
        (void)simulation->step(true, {});
        Loading loading(whole, {.changes = 50, .bytes = 4096, .seen = seen});
        while (!loading.done()) ASSERT_TRUE(loading.frame(*simulation).outcomes.at(0).result);
    }
    ASSERT_EQ(few.scene().stateHash(), atOnce.scene().stateHash());
    const StateHash begun = few.scene().stateHash();
    for (int i = 0; i < 60; ++i) {
        (void)atOnce.step(false, {});
        (void)few.step(false, {});
        ASSERT_EQ(few.scene().stateHash(), atOnce.scene().stateHash()) << i;
    }
    EXPECT_NE(few.scene().stateHash(), begun) << "they fall";
    for (const ObjectId id : few.scene().root().children) {
        const Transform* place = few.scene().coreOf<Transform>(*few.scene().get<Node>(id));
        if (place && few.scene().get<Node>(id)->name == "body") {
            EXPECT_GT(place->translation.y(), 0.4);
        }
    }
}

TEST(LoadParts, WhatAppearsIsNobodyElsesButWhatFollowsItIsSaid) {
    Random random(1);
    Simulation simulation;
    test::ListMaker make;
    make.node("mine", kRootNode);
    ASSERT_TRUE(simulation.step(true, one(Edit::Kind::kChange, make.builder.take())).outcomes[0].result);
    Loading loading(tree(random, 200), {.changes = 50, .bytes = 4096, .seen = 10});
    while (!simulation.appearing()) ASSERT_TRUE(loading.frame(simulation).outcomes[0].result);
    const ObjectId seen = seenNodes(simulation.scene()).back();
    const auto edit = [&](ChangeList list) { return Edit{.list = std::move(list)}; };
    ChangeListBuilder name;
    setField<&Node::name>(name, seen, std::string("mine"));
    FrameResult result = simulation.step(false, one(edit(name.take())));
    ASSERT_FALSE(result.outcomes[0].result);
    EXPECT_WORDS(result.outcomes[0].result.error().message);
    // Of the server only what it says of what is seen.
    ChangeListBuilder levels;
    setField<&Node::levels>(levels, seen, std::int64_t{1});
    Edit choice{.ticket = LevelChoice::kTicket, .list = levels.take(), .undoable = false};
    Edit others = choice;
    others.ticket = 12;
    EXPECT_FALSE(simulation.step(false, one(std::move(others))).outcomes[0].result);
    EXPECT_TRUE(simulation.step(false, one(std::move(choice))).outcomes[0].result);
    EXPECT_EQ(simulation.scene().get<Node>(seen)->levels, 1);
    // Steps wait: one of them may take away what the rest is to hang below.
    result = simulation.step(false, one(Edit::Kind::kUndo));
    ASSERT_FALSE(result.outcomes[0].result);
    EXPECT_WORDS(result.outcomes[0].result.error().message);
    EXPECT_EQ(simulation.history().undoDepth(), 1u);
    while (!loading.done()) ASSERT_TRUE(loading.frame(simulation).outcomes[0].result);
    EXPECT_FALSE(simulation.appearing());
    ASSERT_TRUE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes[0].result);
    while (simulation.stepUnderWay()) (void)simulation.step(false, {});
    EXPECT_EQ(simulation.scene().objectCount(), 2u);
}

TEST(LoadParts, LeaveAListWholeThatIsSmallOrDoesMoreThanCreate) {
    test::ListMaker make;
    for (int i = 0; i < 10; ++i) make.node("n", kRootNode);
    const ChangeList small = make.builder.take();
    EXPECT_EQ(cutForFrames(small, kSmall), std::vector{small});
    for (int i = 0; i < 100; ++i) make.node("n", kRootNode);
    make.builder.destroy(ObjectId(17));
    const ChangeList other = make.builder.take();
    EXPECT_EQ(cutForFrames(other, kSmall), std::vector{other});
}

TEST(LoadParts, AreCutByTheirBytesToo) {
    test::ListMaker make;
    for (int i = 0; i < 40; ++i) make.node(std::string(1000, 'n'), kRootNode);
    const std::vector<ChangeList> parts = cutForFrames(make.builder.take(), {.changes = 100'000, .bytes = 4096});
    EXPECT_GE(parts.size(), 11u);
}

TEST(LoadParts, AreOneStepInBothDirectionsAPartAFrame) {
    forSeeds(20, [](Random& random) {
        Simulation simulation;
        ASSERT_TRUE(simulation.load({test::craneScene(false)}));
        (void)simulation.step(true, {});
        const std::size_t children = simulation.scene().root().children.size();
        // Without the crane's motion states compare.
        ChangeListBuilder stand;
        setField<&Motion::playing>(
            stand, simulation.scene().get<Node>(findNode(simulation.scene(), "/motion").value())->core, false);
        (void)simulation.step(false, one(Edit::Kind::kChange, stand.take()));
        const StateHash before = simulation.scene().stateHash();

        ChangeList whole = forest(random, 200);
        standStill(whole);
        Loading loading(whole);
        const std::size_t frames = loading.count();
        while (!loading.done()) ASSERT_TRUE(loading.frame(simulation).outcomes[0].result);
        const StateHash after = simulation.scene().stateHash();
        ASSERT_EQ(simulation.history().undoDepth(), 2u);

        for (int round = 0; round < 2; ++round) {
            FrameResult result = simulation.step(false, one(Edit::Kind::kUndo));
            ASSERT_TRUE(result.outcomes[0].result);
            EXPECT_FALSE(result.outcomes[0].underWay);
            EXPECT_EQ(simulation.scene().root().children.size(), children) << "it is gone at once";
            EXPECT_FALSE(simulation.step(false, one(Edit::Kind::kRedo)).outcomes[0].result) << "one step at a time";
            for (std::size_t i = 2; i < frames; ++i) {
                ASSERT_TRUE(simulation.stepUnderWay());
                result = simulation.step(false, {});
                ASSERT_LE(result.commit.list->changeCount(), 2 * kSmall.changes);
            }
            ASSERT_FALSE(simulation.stepUnderWay());
            EXPECT_EQ(simulation.scene().stateHash(), before);
            EXPECT_EQ(simulation.history().redoDepth(), 1u);

            result = simulation.step(false, one(Edit::Kind::kRedo));
            ASSERT_TRUE(result.outcomes[0].underWay);
            std::size_t took = 1;
            while (simulation.stepUnderWay()) {
                EXPECT_EQ(simulation.scene().root().children.size(), children) << "it appears whole";
                result = simulation.step(false, {});
                ++took;
            }
            EXPECT_EQ(took, frames);
            ASSERT_EQ(result.outcomes.size(), 1u) << "the redo's, now that it is whole";
            EXPECT_TRUE(result.outcomes[0].result);
            EXPECT_EQ(simulation.scene().stateHash(), after);
            EXPECT_EQ(simulation.history().undoDepth(), 2u);
        }
    });
}

TEST(LoadParts, WhatIsOnItsWayIsNobodyElses) {
    Random random(1);
    Simulation simulation;
    Loading loading(forest(random, 200));
    (void)loading.frame(simulation);
    (void)loading.frame(simulation);
    const ObjectId hidden = simulation.scene().ids().back();
    const auto refused = [&](ChangeList list) {
        const FrameResult result = simulation.step(false, one(Edit::Kind::kChange, std::move(list)));
        return result.outcomes[0].result ? std::string() : result.outcomes[0].result.error().message;
    };
    ChangeListBuilder list;
    list.place(hidden, kRootNode);
    EXPECT_WORDS(refused(list.take()));
    list.destroy(hidden);
    EXPECT_WORDS(refused(list.take()));
    setField<&Node::core>(list, kRootNode, hidden);
    EXPECT_WORDS(refused(list.take()));
    list.detach(ObjectId(hidden.value + 100));
    EXPECT_WORDS(refused(list.take()));
    // Everything else goes on, with ids behind them, and undo is of that.
    test::ListMaker make;
    make.node("mine", kRootNode);
    EXPECT_EQ(refused(make.builder.take()), "");
    EXPECT_TRUE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes[0].result);
    while (!loading.done()) ASSERT_TRUE(loading.frame(simulation).outcomes[0].result);
    list.destroy(hidden);
    EXPECT_EQ(refused(list.take()).find("is still being loaded"), std::string::npos);
}

TEST(LoadParts, WhatCannotBeFinishedIsTakenAwayAgain) {
    forSeeds(20, [](Random& random) {
        Simulation simulation;
        test::ListMaker make;
        const ObjectId yard = simulation
                                  .step(true,
                                        [&] {
                                            make.node("yard", kRootNode);
                                            return one(Edit::Kind::kChange, make.builder.take());
                                        }())
                                  .outcomes[0]
                                  .result->ids.at(0)
                                  .second;
        Loading loading(forest(random, 200, yard));
        // Somebody takes away what it was to hang below.
        const std::size_t when = 1 + below(random, loading.count() - 1);
        for (std::size_t i = 0; i < when; ++i) ASSERT_TRUE(loading.frame(simulation).outcomes[0].result);
        ChangeListBuilder list;
        list.detach(yard);
        list.destroy(yard);
        ASSERT_TRUE(simulation.step(false, one(Edit::Kind::kChange, list.take())).outcomes[0].result);
        FrameResult result;
        while (!loading.done()) result = loading.frame(simulation);
        ASSERT_FALSE(result.outcomes[0].result);
        while (simulation.stepUnderWay()) {
            result = simulation.step(false, {});
            EXPECT_LE(result.commit.list->changeCount(), 2 * kSmall.changes) << "in parts, too";
        }
        EXPECT_EQ(simulation.scene().objectCount(), 1u);
        EXPECT_EQ(simulation.history().undoDepth(), 2u) << "what others did";
        EXPECT_EQ(simulation.history().redoDepth(), 0u);
        EXPECT_TRUE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes[0].result);
    });
}

TEST(LoadParts, WhatCannotFitIsRefusedBeforeTheFirst) {
    Random random(1);
    SimulationOptions options;
    options.scene.maxObjects = 300;
    Simulation simulation(options);
    Loading loading(forest(random, 200));
    const FrameResult result = loading.frame(simulation);
    ASSERT_FALSE(result.outcomes[0].result);
    EXPECT_EQ(result.outcomes[0].result.error().code, ErrorCode::kLimit);
    EXPECT_EQ(simulation.scene().objectCount(), 1u);
    EXPECT_FALSE(simulation.stepUnderWay());
}

TEST(LoadParts, AnEditAfterTheUndoLeavesNothingToRedo) {
    Random random(1);
    Simulation simulation;
    Loading loading(forest(random, 200));
    while (!loading.done()) (void)loading.frame(simulation);
    (void)simulation.step(false, one(Edit::Kind::kUndo));
    test::ListMaker make;
    make.node("mine", kRootNode);
    ASSERT_TRUE(simulation.step(false, one(Edit::Kind::kChange, make.builder.take())).outcomes[0].result);
    while (simulation.stepUnderWay()) (void)simulation.step(false, {});
    EXPECT_EQ(simulation.scene().objectCount(), 2u);
    EXPECT_EQ(simulation.history().redoDepth(), 0u);
    EXPECT_EQ(simulation.history().undoDepth(), 1u);
    const std::uint64_t held = simulation.history().bytes();
    EXPECT_LT(held, 1000u);
}

}  // namespace
}  // namespace tessera
