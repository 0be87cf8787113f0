/// What Inlines hold, while it is seen in parts.
#include "tests/unit/sim/InlineStage.h"

namespace tessera {
namespace {

using L = LoadWords;

/// Content that is seen a node more in each frame, and who bears it.
struct Appearing : test::InlineStage {
    Appearing() {
        parts = {.changes = 40, .seen = 1};
        nodesInFile = 20;
        empty = scene().objectCount();
        node = place(Inline{.file = "/a"});
        steps = simulation.history().undoDepth();
        frame();
        fileComes();
        while (!coming.empty() && !simulation.appearing()) frame();
        frames(3);
        EXPECT_TRUE(simulation.appearing());
        EXPECT_EQ(below(node), 1u);
        EXPECT_EQ(wishOf(node).state, L::kLoading);
    }
    std::size_t empty = 0, steps = 0;
    ObjectId node;
};

TEST(InlinesAppear, AndAStepThatTakesThemAwayWaitsUntilTheyAreThere) {
    Appearing stage;
    EXPECT_FALSE(stage.undo().result);
    EXPECT_EQ(stage.simulation.history().undoDepth(), stage.steps) << "refused, not forgotten";
    stage.frames(40);
    EXPECT_EQ(stage.wishOf(stage.node).state, L::kThere);
    EXPECT_TRUE(stage.undo().result);
    EXPECT_EQ(stage.scene().objectCount(), stage.empty);
}

TEST(InlinesAppear, WhatAppearsAndIsNotWantedAnyMoreGoesBeforeTheNextFileComes) {
    Appearing stage;
    EXPECT_TRUE(stage.set<&Inline::file>(stage.node, std::string("/b")).result);
    for (int i = 0; i < 200 && !stage.order; ++i) stage.frame();
    ASSERT_TRUE(stage.order) << stage.problemOf(stage.node);
    EXPECT_EQ(stage.order->path, "/b");
    EXPECT_EQ(stage.scene().objectCount(), stage.empty + 2) << "the node and its core";
    stage.fileComes();
    stage.frames(100);
    EXPECT_EQ(stage.wishOf(stage.node).state, L::kThere);
    EXPECT_EQ(stage.scene().get<Node>(stage.scene().get<Node>(stage.node)->children.front())->name, "/b");
}

TEST(InlinesAppear, NothingOfWhatIsNotWantedAnyMore) {
    test::InlineStage stage;
    stage.parts = {.changes = 40, .seen = 1};
    stage.nodesInFile = 20;
    const ObjectId node = stage.place(Inline{.file = "/a"});
    stage.frame();
    stage.fileComes();
    stage.frames(2);
    EXPECT_TRUE(stage.set<&Inline::file>(node, std::string("/b")).result);
    for (int i = 0; i < 200 && !stage.order; ++i) {
        stage.frame();
        EXPECT_EQ(stage.below(node), 0u);
    }
    EXPECT_TRUE(stage.order);
}

TEST(InlinesAppear, ThatLetTheirContentGoTakeAlongWhatIsJustAppearingInIt) {
    test::InlineStage stage;
    const std::size_t empty = stage.scene().objectCount();
    const ObjectId node = stage.place(Inline{.file = "/a", .load = L::kByHand});
    ASSERT_TRUE(stage.set<&Inline::wanted>(node, true).result);
    stage.frame();
    stage.fileComes();
    stage.frames(5);
    ASSERT_EQ(stage.wishOf(node).state, L::kThere);
    // Somebody loads into it, and it goes when a part of that is seen.
    for (int frames = 1; frames < 30; ++frames) {
        test::ListMaker make;
        const ObjectId top = make.node("top", stage.scene().get<Node>(node)->children.front());
        for (int i = 0; i < 15; ++i) make.node("n", top, make.transform(Vec3d::Zero()));
        ChangeList content = make.builder.take();
        const std::size_t objects = content.creations.size();
        std::vector<ChangeList> cut = cutForFrames(std::move(content), {.changes = 12, .seen = 2});
        std::size_t next = 0;
        const auto part = [&] {
            Edit edit{.ticket = 7, .list = cut[next++], .kind = Edit::Kind::kPart, .objects = objects};
            if (next == cut.size()) edit.kind = Edit::Kind::kLastPart;
            return stage.frame(std::move(edit)).result.has_value();
        };
        for (int i = 0; i < frames && next < cut.size(); ++i) EXPECT_TRUE(part());
        const bool whole = next == cut.size();
        ASSERT_TRUE(stage.set<&Inline::wanted>(node, false).result);
        EXPECT_EQ(stage.below(node), 0u) << frames;
        if (!whole) {
            while (next < cut.size() && part()) {
            }
        }
        stage.frames(40);
        EXPECT_EQ(stage.scene().objectCount(), empty + 2) << "nothing is left that hangs nowhere, after " << frames;
        EXPECT_FALSE(stage.simulation.history().arriving());
        if (whole) return;
        ASSERT_TRUE(stage.set<&Inline::wanted>(node, true).result);
        for (int i = 0; i < 20 && !stage.order; ++i) stage.frame();
        stage.fileComes();
        stage.frames(5);
    }
    FAIL() << "it was never whole";
}

}  // namespace
}  // namespace tessera
