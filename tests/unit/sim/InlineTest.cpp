/// Inlines and ProxyGroups: what is loaded when, what goes again, and what undo makes of it; over random histories
/// never twice and never half.
#include <gtest/gtest.h>

#include <map>

#include "common/drawable/Drawable.h"
#include "common/drawable/SceneBounds.h"
#include "common/scene/Edits.h"
#include "server/sim/report/Report.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/InlineStage.h"

namespace tessera {
namespace {

using test::InlineStage;
using test::ListMaker;
using L = LoadWords;

TEST(Inlines, AreLoadedAtOnceWholeAndAreNobodysStep) {
    for (const std::size_t changes : {12u, 10'000u}) {  // in parts, and as one
        InlineStage stage;
        stage.parts.changes = changes;
        stage.nodesInFile = 20;
        const ObjectId node = stage.place(Inline{.file = "/a"});
        stage.frame();
        ASSERT_TRUE(stage.order);
        EXPECT_EQ(stage.order->node, node);
        EXPECT_EQ(stage.wishOf(node).state, L::kLoading);
        const std::size_t steps = stage.simulation.history().undoDepth();
        stage.fileComes();
        while (!stage.coming.empty()) {
            EXPECT_EQ(stage.below(node), 0u) << "it appears whole";
            stage.frame();
        }
        EXPECT_EQ(stage.wishOf(node).state, L::kThere);
        EXPECT_EQ(stage.below(node), 1u);
        EXPECT_EQ(stage.simulation.history().undoDepth(), steps);
        stage.frames(5);
        EXPECT_FALSE(stage.order) << "never twice";
    }
}

TEST(Inlines, AreLoadedNearByHandAndLetGo) {
    InlineStage stage;
    const ObjectId hand = stage.place(Inline{.file = "/hand", .load = L::kByHand});
    // The head is at (0, 0.5, 2): 2.06 m from the origin, and 1 m from the box.
    const ObjectId near = stage.place(Inline{.file = "/near", .load = L::kNear, .distance = 2.0});
    const ObjectId box = stage.place(ProxyGroup{
        .file = "/box", .load = L::kNear, .distance = 0.9, .lower = Vec3d(-1, 0, -1), .upper = Vec3d(1, 1, 1)});
    const std::size_t empty = stage.scene().objectCount();
    stage.frames(3);
    EXPECT_FALSE(stage.order);
    EXPECT_TRUE(stage.set<&ProxyGroup::distance>(box, 1.1).result);
    stage.frames(1);
    ASSERT_TRUE(stage.order);
    EXPECT_EQ(stage.order->path, "/box");
    stage.fileComes();
    stage.frames(3);
    EXPECT_EQ(stage.wishOf(box).state, L::kThere);
    stage.view.users[0].position = Vec3d(0, 0.5, 1.9);
    stage.frames(2);
    ASSERT_TRUE(stage.order);
    EXPECT_EQ(stage.order->path, "/near");
    stage.fileComes();
    stage.frames(3);
    stage.view.users[0].position = Vec3d(0, 0.5, 100);
    stage.frames(3);
    EXPECT_EQ(stage.wishOf(near).state, L::kThere) << "who goes away takes nothing away";
    EXPECT_TRUE(stage.set<&Inline::wanted>(hand, true).result);
    stage.frames(1);
    stage.fileComes();
    stage.frames(3);
    EXPECT_EQ(stage.wishOf(hand).state, L::kThere);
    // Both go when they are not wanted any more: the frame that says so is the one that shows it.
    EXPECT_TRUE(stage.set<&Inline::wanted>(hand, false).result);
    EXPECT_EQ(stage.below(hand), 0u);
    EXPECT_EQ(stage.wishOf(hand).state, L::kWaiting);
    EXPECT_TRUE(stage.set<&Inline::wanted>(near, true).result);
    EXPECT_EQ(stage.below(near), 1u);
    EXPECT_TRUE(stage.set<&Inline::wanted>(near, false).result);
    EXPECT_EQ(stage.below(near), 0u);
    EXPECT_TRUE(stage.set<&ProxyGroup::file>(box, std::string("/other")).result);
    EXPECT_EQ(stage.scene().objectCount(), empty) << "nothing is left of any";
}

TEST(Inlines, AnotherFileTakesTheOldOnesPlaceAlsoInTheMiddle) {
    InlineStage stage;
    stage.nodesInFile = 20;
    const ObjectId node = stage.place(Inline{.file = "/a"});
    stage.frame();
    stage.fileComes();
    stage.frames(2);
    ASSERT_FALSE(stage.coming.empty());
    EXPECT_TRUE(stage.set<&Inline::file>(node, std::string("/b")).result);
    stage.frames(30);
    EXPECT_EQ(stage.below(node), 0u) << "what comes too late is not taken";
    ASSERT_TRUE(stage.order);
    EXPECT_EQ(stage.order->path, "/b");
    stage.fileComes();
    stage.frames(30);
    ASSERT_EQ(stage.below(node), 1u);
    EXPECT_EQ(stage.scene().get<Node>(stage.scene().get<Node>(node)->children.front())->name, "/b");
    // And back, by undo: the file that the scene says then is the one that is there.
    EXPECT_TRUE(stage.undo().result);
    EXPECT_EQ(stage.below(node), 0u);
    stage.frames(1);
    ASSERT_TRUE(stage.order);
    EXPECT_EQ(stage.order->path, "/a");
}

TEST(Inlines, UndoTakesTheNodeWithWhatCameAndRedoLoadsAnew) {
    InlineStage stage;
    const std::size_t empty = stage.scene().objectCount();
    const ObjectId node = stage.place(Inline{.file = "/a"});
    stage.frame();
    stage.fileComes();
    stage.frames(3);
    ASSERT_EQ(stage.wishOf(node).state, L::kThere);
    const EditOutcome back = stage.undo();
    EXPECT_TRUE(back.result) << back.result.error().message;
    EXPECT_EQ(stage.scene().objectCount(), empty);
    EXPECT_TRUE(stage.redo().result);
    EXPECT_EQ(stage.wishOf(node).state, L::kWaiting);
    stage.frames(1);
    EXPECT_TRUE(stage.order);
}

TEST(Inlines, AStepThatSpeaksOfWhatHasGoneIsForgottenAndTheNextIsTaken) {
    InlineStage stage;
    const ObjectId other = stage.place(Inline{.file = "/x", .load = L::kByHand});
    const ObjectId node = stage.place(Inline{.file = "/a"});
    stage.frame();
    stage.fileComes();
    stage.frames(3);
    const ObjectId inside = stage.scene().get<Node>(node)->children.front();
    ChangeListBuilder rename;
    setField<&Node::name>(rename, inside, std::string("mine"));
    EXPECT_TRUE(stage.edit(rename.take()).result);
    EXPECT_TRUE(stage.set<&Inline::file>(node, std::string("/b")).result);
    EXPECT_TRUE(stage.undo().result);  // the file; its content has other ids now
    const EditOutcome refused = stage.undo();
    ASSERT_FALSE(refused.result);
    EXPECT_WORDS(refused.result.error().message);
    EXPECT_TRUE(stage.undo().result);  // placing it
    EXPECT_FALSE(stage.scene().get<Node>(node));
    EXPECT_TRUE(stage.undo().result);
    EXPECT_FALSE(stage.scene().get<Node>(other));
    EXPECT_EQ(stage.simulation.history().undoDepth(), 0u);
}

TEST(Inlines, WhatCannotBeIsSaidInWordsAndTriedAgainWhenWanted) {
    InlineStage stage;
    const auto problem = [&](ObjectId node) {
        stage.frames(2);
        EXPECT_EQ(stage.wishOf(node).state, L::kFailed);
        return stage.problemOf(node);
    };
    EXPECT_WORDS(problem(stage.place(Inline{})));
    // Two nodes, one core.
    const ObjectId first = stage.place(Inline{.file = "/a", .load = L::kByHand});
    test::ListMaker second;
    second.node("second", kRootNode, stage.coreOf(first));
    EXPECT_TRUE(stage.edit(second.builder.take()).result);
    EXPECT_TRUE(stage.set<&Inline::wanted>(first, true).result);
    EXPECT_WORDS(problem(first));
    // Somebody's own nodes are not mixed with a file's, and not taken away.
    const ObjectId full = stage.place(Inline{.file = "/b", .load = L::kByHand});
    test::ListMaker own;
    own.node("own", full);
    EXPECT_TRUE(stage.edit(own.builder.take()).result);
    EXPECT_TRUE(stage.set<&Inline::wanted>(full, true).result);
    EXPECT_WORDS(problem(full));
    // A file that cannot be read; and again.
    const ObjectId bad = stage.place(Inline{.file = "/c"});
    stage.frame();
    stage.fileFails("/c: no such file");
    EXPECT_WORDS(problem(bad));
    EXPECT_FALSE(stage.order);
    EXPECT_TRUE(stage.set<&Inline::wanted>(bad, true).result);
    stage.frames(1);
    ASSERT_TRUE(stage.order) << "whoever wants it has it tried again";
    stage.fileComes();
    stage.frames(3);
    EXPECT_EQ(stage.problemOf(bad), "");
    // Nested too deep.
    ObjectId parent = kRootNode;
    for (std::size_t i = 0; i < InlineLoading::kMostChain; ++i) {
        parent = stage.place(Inline{.file = "/deep" + std::to_string(i)}, parent);
        stage.frame();
        stage.fileComes();
        stage.frames(3);
        parent = stage.scene().get<Node>(parent)->children.front();
    }
    EXPECT_WORDS(problem(stage.place(Inline{.file = "/deepest"}, parent)));
    EXPECT_FALSE(stage.order);
}

TEST(Inlines, OfOneLoadEndSomewhereAndSaySo) {
    // Each file inlines as many as the depth lets there be: without a bound they would be thousands of millions.
    InlineStage stage;
    stage.parts = {};
    stage.nodesInFile = 1;
    test::ListMaker make;
    const ObjectId top = make.node("load", kRootNode);
    constexpr std::size_t kMany = InlineLoading::kMostBrought + 40;
    for (std::size_t i = 0; i < kMany; ++i) {
        const ObjectId core = make.create<Inline>();
        setField<&Inline::file>(make.builder, core, "f");
        make.node("i", top, core);
    }
    ASSERT_TRUE(stage.edit(make.builder.take()).result);
    const ObjectId other = stage.place<Inline>({.file = "other"});
    std::size_t came = 0;
    for (std::size_t quiet = 0; quiet < 300 && came < kMany + 10; ++quiet) {
        stage.frame();
        if (!stage.order) continue;
        stage.fileComes();
        ++came;
        quiet = 0;
    }
    EXPECT_EQ(came, InlineLoading::kMostBrought + 1) << "and that of the other, which is not below it";
    EXPECT_EQ(stage.wishOf(other).state, L::kThere);
    std::size_t failed = 0;
    ObjectId one;
    for (const ObjectId node : stage.scene().get<Node>(stage.scene().get<Node>(kRootNode)->children[0])->children) {
        if (stage.wishOf(node).state != L::kFailed) continue;
        ++failed;
        one = node;
        EXPECT_EQ(stage.problemOf(node), "4096 Inlines below 'load' have content already, and no more may");
    }
    EXPECT_EQ(failed, 40u);
    // Where others have gone there is room again.
    const auto& children = stage.scene().get<Node>(stage.scene().get<Node>(kRootNode)->children[0])->children;
    const std::vector<ObjectId> going{children[0], children[1], children[2]};
    ASSERT_TRUE(stage.edit(removalOf(stage.scene(), going)).result);
    ASSERT_TRUE(stage.set<&Inline::wanted>(one, true).result);
    for (int i = 0; i < 300 && !stage.order; ++i) stage.frame();
    EXPECT_TRUE(stage.order);
}

/// A scene as it goes on, as it is started with, as a file brings it: content that nobody has ordered here.
TEST(Inlines, ContentThatWasThereBeforeCountsWhereItStands) {
    InlineStage before;
    test::ListMaker make;
    const ObjectId here = make.node("here", kRootNode), there = make.node("there", kRootNode);
    for (std::size_t i = 0; i < InlineLoading::kMostBrought; ++i) {
        const ObjectId core = make.create<Inline>();
        setField<&Inline::file>(make.builder, core, "f");
        setField<&Inline::state>(make.builder, core, L::kThere);
        make.node("i", i % 2 == 0 ? here : there, core);
    }
    const EditOutcome made = before.edit(make.builder.take());
    ASSERT_TRUE(made.result) << made.result.error().message;
    const auto idOf = [&](ObjectId placeholder) {
        return std::ranges::find(made.result->ids, placeholder, &std::pair<ObjectId, ObjectId>::first)->second;
    };
    const ObjectId hereNode = idOf(here), thereNode = idOf(there);
    const auto half = [&](InlineStage& stage) {
        const ObjectId more = stage.place(Inline{.file = "more"}, hereNode);
        for (int i = 0; i < 5 && !stage.order; ++i) stage.frame();
        ASSERT_TRUE(stage.order) << "half of them are elsewhere";
        stage.fileFails("no");
        stage.frames(2);
        EXPECT_EQ(stage.problemOf(more), "no");
    };
    const auto full = [&](InlineStage& stage, ObjectId top) {
        const ObjectId more = stage.place(Inline{.file = "more"}, top);
        stage.frames(5);
        EXPECT_FALSE(stage.order);
        EXPECT_WORDS(stage.problemOf(more));
    };
    ASSERT_NO_FATAL_FAILURE(half(before));
    // All stand below one now.
    ChangeListBuilder move;
    move.place(thereNode, hereNode);
    ASSERT_TRUE(before.edit(move.take()).result);
    ASSERT_NO_FATAL_FAILURE(full(before, hereNode));
    // Another server goes on with it.
    InlineStage after;
    Aspect left;
    ASSERT_TRUE(left.apply(snapshot(before.scene())));
    ASSERT_TRUE(after.replica.apply(snapshot(before.scene())));
    after.simulation.goOnFrom(
        {.scene = std::move(left), .sequence = before.simulation.sequence(), .history = {}, .display = {}});
    ASSERT_NO_FATAL_FAILURE(full(after, hereNode));
    // What has been moved away counts there no more.
    ChangeListBuilder back;
    back.place(thereNode, kRootNode);
    ASSERT_TRUE(after.edit(back.take()).result);
    ASSERT_NO_FATAL_FAILURE(half(after));
}

TEST(Inlines, OnlyTheServerSaysTheirState) {
    InlineStage stage;
    const ObjectId node = stage.place(Inline{.file = "/a", .load = L::kByHand});
    for (const std::int64_t state : {L::kWaiting, L::kLoading, L::kThere, L::kFailed})
        EXPECT_FALSE(stage.set<&Inline::state>(node, state).result);
    EXPECT_FALSE(stage.set<&Inline::problem>(node, std::string("mine")).result);
    EXPECT_EQ(stage.wishOf(node).state, L::kWaiting);
}

TEST(Inlines, WhatIsRemovedWhileItLoadsLeavesNothing) {
    InlineStage stage;
    stage.nodesInFile = 30;
    const std::size_t empty = stage.scene().objectCount();
    (void)stage.place(Inline{.file = "/a"});
    stage.frame();
    stage.fileComes();
    stage.frames(4);
    ASSERT_FALSE(stage.coming.empty());
    EXPECT_TRUE(stage.undo().result);
    stage.frames(40);
    EXPECT_EQ(stage.scene().objectCount(), empty);
    EXPECT_FALSE(stage.simulation.history().arriving());
}

TEST(Inlines, ALoadThatARestartInterruptedBeginsAgain) {
    InlineStage stage;
    stage.nodesInFile = 20;
    const ObjectId node = stage.place(Inline{.file = "/a"});
    stage.frame();
    stage.fileComes();
    stage.frames(3);
    ASSERT_FALSE(stage.coming.empty());
    // What a journal has of it: the scene and the history; who loaded is gone.
    InlineStage after;
    Aspect left;
    ASSERT_TRUE(left.apply(snapshot(stage.scene())));
    ASSERT_TRUE(after.replica.apply(snapshot(stage.scene())));
    EditHistory history;
    for (EditHistory::Kept& step : stage.simulation.history().kept()) ASSERT_TRUE(history.keep(std::move(step)));
    after.simulation.goOnFrom({.scene = std::move(left),
                               .sequence = stage.simulation.sequence(),
                               .history = std::move(history),
                               .display = {}});
    after.frames(10);
    ASSERT_TRUE(after.order);
    EXPECT_EQ(after.order->node, node);
    after.fileComes();
    after.frames(10);
    EXPECT_EQ(after.below(node), 1u) << "never twice";
}

TEST(Inlines, AFrameCostsNothingThatGrowsWithTheScene) {
    std::map<std::size_t, std::uint64_t> work;
    for (const std::size_t count : {1'000u, 100'000u}) {
        test::ListMaker make;
        const ObjectId place = make.transform(Vec3d::Zero());
        make.node("moves", kRootNode, place);
        for (std::size_t i = 0; i < count; ++i) make.node("n", kRootNode, make.create<Inline>());
        Committer committer;
        const Aspect& scene = committer.scene();
        InlineContents contents;
        const auto apply = [&](ChangeList list) {
            const Expected<Committer::Applied> applied = committer.apply(std::move(list));
            ASSERT_TRUE(applied) << applied.error().message;
            contents.update(scene, applied->list.get());
        };
        apply(make.builder.take());
        const ObjectId mover = test::transformAt(scene, "/moves");
        InlineLoading loading{test::wallOfOne()};
        const std::uint64_t before = contents.work() + loading.work();
        for (int i = 0; i < 10; ++i) {
            apply(test::moveTo(mover, Vec3d(i, 0, 0)));
            ChangeList states = loading.advance(scene, contents, View());
        }
        work[count] = contents.work() + loading.work() - before;
    }
    EXPECT_EQ(work[1'000], work[100'000]);
    EXPECT_EQ(work[1'000], 10 * InlineLoading::kPerFrame);
}

TEST(ProxyGroups, AreTheirBoxUntilTheirContentIsThereAndAreCountedUntilThen) {
    ProxyGroup proxy{.lower = Vec3d(-1, 0, -2), .upper = Vec3d(1.1, 3, 2)};
    const Drawable box = drawableOf(Object::of(proxy));
    ASSERT_TRUE(box);
    EXPECT_TRUE(box.check());
    EXPECT_TRUE(checkMesh(box.arrays()));
    EXPECT_EQ(box.arrays().lines.sizeBytes(), 12 * 2 * sizeof(std::uint32_t));
    // Around all that is in the box, as floats are.
    EXPECT_TRUE((box.bounds().lower.array() <= proxy.lower.array()).all() &&
                (box.bounds().upper.array() >= proxy.upper.array()).all());
    EXPECT_TRUE(box.bounds().lower.isApprox(proxy.lower, 1e-6) && box.bounds().upper.isApprox(proxy.upper, 1e-6));
    proxy.state = L::kThere;
    EXPECT_TRUE(drawableOf(Object::of(proxy)).arrays().positions.empty());
    proxy = {.lower = Vec3d(0, 1, 0), .upper = Vec3d(1, 0, 1)};
    EXPECT_FALSE(drawableOf(Object::of(proxy)).check());
    EXPECT_TRUE(drawableOf(Object::of(ProxyGroup())).check()) << "a box that is not known is none";
    EXPECT_TRUE(drawableOf(Object::of(ProxyGroup())).arrays().positions.empty());

    InlineStage stage;
    const ObjectId node =
        stage.place(ProxyGroup{.file = "/p", .load = L::kByHand, .lower = Vec3d(-4, 0, -1), .upper = Vec3d(5, 1, 1)});
    EXPECT_TRUE(stage.set<&ProxyGroup::nodes>(node, std::int64_t{12}).result);
    EXPECT_TRUE(stage.set<&ProxyGroup::triangles>(node, std::int64_t{3400}).result);
    EXPECT_FALSE(stage.set<&ProxyGroup::lower>(node, Vec3d(6, 0, 0)).result) << "upside down";
    EXPECT_EQ(sceneBounds(stage.scene()).upper.x(), 5.0);
    SceneCounts counts = countScene(stage.scene());
    EXPECT_EQ(counts.promised, 1u);
    EXPECT_EQ(counts.promisedNodes, 12u);
    EXPECT_EQ(counts.promisedTriangles, 3400u);
    EXPECT_EQ(counts.triangles, 0u);
    EXPECT_TRUE(stage.set<&ProxyGroup::wanted>(node, true).result);
    stage.frames(1);
    stage.fileComes();
    stage.frames(3);
    counts = countScene(stage.scene());
    EXPECT_EQ(counts.promised, 0u);
    EXPECT_EQ(counts.triangles, 24u);
}

/// The inner one goes with what the outer one holds, whichever of them the list names first.
TEST(Inlines, OneWithinAnothersContentGoesWithIt) {
    for (const bool outerFirst : {true, false})
        for (const bool renamed : {true, false}) {
            InlineStage stage;
            const auto comes = [&](ObjectId node) {
                EXPECT_TRUE(stage.set<&Inline::wanted>(node, true).result);
                stage.frames(1);
                stage.fileComes();
                stage.frames(20);
                EXPECT_EQ(stage.wishOf(node).state, L::kThere);
            };
            const ObjectId outer = stage.place(Inline{.file = "/outer", .load = L::kByHand});
            comes(outer);
            const ObjectId inner = stage.place(Inline{.file = "/inner", .load = L::kByHand},
                                               stage.scene().get<Node>(outer)->children.front());
            comes(inner);
            ChangeListBuilder both;
            for (const ObjectId node : {outerFirst ? outer : inner, outerFirst ? inner : outer}) {
                if (renamed)
                    setField<&Inline::file>(both, stage.coreOf(node), std::string("/other"));
                else
                    setField<&Inline::wanted>(both, stage.coreOf(node), false);
            }
            EXPECT_TRUE(stage.edit(both.take()).result);
            stage.frames(10);
            EXPECT_EQ(stage.below(outer), 0u);
            EXPECT_FALSE(stage.scene().get<Node>(inner));
        }
}

/// What is always so: content is there whole, once, of the file that is said, or not at all; but for the frames in
/// which it appears or is hidden.
void expectSound(const InlineStage& stage) {
    if (stage.simulation.appearing() || stage.simulation.stepUnderWay()) return;
    for (const ObjectId id : stage.scene().ids()) {
        const Node* node = stage.scene().get<Node>(id);
        const std::optional<LoadWish> wish =
            node && node->core ? loadWishOf(stage.scene().find(node->core)) : std::nullopt;
        if (!wish || wish->state == L::kFailed) continue;
        EXPECT_EQ(node->children.size(), wish->state == L::kThere ? 1u : 0u) << "#" << id.value;
        for (const ObjectId child : node->children) EXPECT_EQ(stage.scene().get<Node>(child)->name, wish->file);
    }
}

TEST(Inlines, OverRandomHistoriesAreThereWholeOnceOrNotAtAll) {
    forSeeds(60, [](Random& random) {
        InlineStage stage;
        if (oneIn(random, 2)) stage.parts.seen = 1 + below(random, 6);
        std::vector<ObjectId> nodes;
        for (int turn = 0; turn < 120 && !testing::Test::HasFailure(); ++turn) {
            stage.nodesInFile = 2 + below(random, 12);
            std::erase_if(nodes, [&](ObjectId id) { return !stage.scene().get<Node>(id); });
            const ObjectId some = nodes.empty() ? ObjectId() : nodes[below(random, nodes.size())];
            const std::string file = "/" + std::to_string(below(random, 3));
            switch (below(random, 14)) {
                case 0:
                case 1:
                    nodes.push_back(stage.place(Inline{.file = file,
                                                       .load = static_cast<std::int64_t>(below(random, 3)),
                                                       .distance = oneIn(random, 2) ? 9.0 : 0.1}));
                    break;
                case 2:
                    if (some) (void)stage.set<&Inline::wanted>(some, oneIn(random, 2));
                    break;
                case 3:
                    if (some) (void)stage.set<&Inline::file>(some, file);
                    break;
                case 4:
                    if (some) (void)stage.set<&Inline::load>(some, static_cast<std::int64_t>(below(random, 3)));
                    break;
                case 5:
                case 6:
                    (void)stage.undo();
                    break;
                case 7:
                    (void)stage.redo();
                    break;
                case 8:
                    if (stage.order) oneIn(random, 4) ? stage.fileFails("no") : stage.fileComes();
                    break;
                case 9:
                    if (!some) break;
                    if (const Expected<ChangeList> gone = removalList(stage.scene(), some)) (void)stage.edit(*gone);
                    break;
                case 10:
                    // Within what another one holds.
                    if (some && stage.below(some) > 0) {
                        ListMaker make;
                        const ObjectId core = make.create<Inline>();
                        setField<&Inline::file>(make.builder, core, file);
                        setField<&Inline::load>(make.builder, core,
                                                std::int64_t{below(random, 2) == 0 ? L::kByHand : L::kAtOnce});
                        make.node("inner", stage.scene().get<Node>(some)->children.front(), core);
                        const EditOutcome placed = stage.edit(make.builder.take());
                        if (placed.result) nodes.push_back(placed.result->ids.back().second);
                    }
                    break;
                case 11: {
                    ChangeListBuilder several;
                    for (const ObjectId id : nodes)
                        if (oneIn(random, 2)) {
                            if (oneIn(random, 2))
                                setField<&Inline::wanted>(several, stage.coreOf(id), oneIn(random, 3));
                            else
                                setField<&Inline::file>(several, stage.coreOf(id), file);
                        }
                    (void)stage.edit(several.take());
                    break;
                }
                default:
                    stage.frames(static_cast<int>(below(random, 5)));
            }
            expectSound(stage);
        }
        // In the end all that is wanted is there, and the way back is free.
        for (int quiet = 0; quiet < 20; ++quiet) {
            if (stage.order || !stage.coming.empty()) quiet = 0;
            if (stage.order) stage.fileComes();
            stage.frame();
        }
        for (const ObjectId id : nodes)
            if (stage.scene().get<Node>(id) && stage.wishOf(id).load == L::kAtOnce) {
                EXPECT_NE(stage.wishOf(id).state, L::kWaiting);
            }
        for (int i = 0; i < 600 && stage.simulation.history().undoDepth() > 0; ++i) {
            (void)stage.undo();
            stage.frame();
            expectSound(stage);
        }
        EXPECT_EQ(stage.simulation.history().undoDepth(), 0u) << "no step is in the way for ever";
    });
}

}  // namespace
}  // namespace tessera
