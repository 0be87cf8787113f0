// Large copies: made beside the frames and brought in parts, and the same as if they came at once.
#include <gtest/gtest.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/RequestDesk.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/frame/Simulation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

/// A simulation, its desk and an application.
struct DeskWithFrames {
    /// `beside`: copies are made beside the frames.
    explicit DeskWithFrames(bool beside) {
        RequestDesk::Surroundings around{.wall = wall,
                                         .blobs = blobs,
                                         .session = server.session,
                                         .simulation = simulation,
                                         .view = view,
                                         .loader = loader,
                                         .drags = drags};
        if (beside) around.orderCopy = [this](Preparation order) { orders.push_back(std::move(order)); };
        desk = std::make_unique<RequestDesk>(around);
        application = server.hello("copier", PeerRole::kApplication);
        desk->applicationJoined(application);
    }
    /// A group of so many nodes with Transforms of their own, one below the other in rows of ten.
    ObjectId group(std::size_t nodes) {
        test::ListMaker make;
        const ObjectId top = make.node("group", kRootNode, make.transform(Vec3d(1, 2, 3)));
        ObjectId above = top;
        for (std::size_t i = 1; i < nodes; ++i) {
            const ObjectId node =
                make.node("n" + std::to_string(i), above, make.transform(Vec3d(static_cast<double>(i), 0, 0)));
            above = i % 10 == 0 ? top : node;
        }
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        return findNode(simulation.scene(), "/group").value();
    }
    void ask(const ApplicationRequest& request) {
        server.take(desk->received({application, "copier", ++asked, share(encodeRequest(request))}, server.now));
    }
    /// What the thread beside does.
    void copy() {
        for (const Preparation& order : std::exchange(orders, {}))
            server.take(desk->prepared(makeCopy(simulation.scene(), order), server.now));
    }
    /// Frames until nobody wants anything. The changes of the largest list.
    std::size_t frames() {
        std::size_t most = 0;
        for (int still = 0; still < 3; still = idle_ ? still + 1 : 0) most = std::max(most, frame());
        return most;
    }
    /// The changes of its list.
    std::size_t frame() {
        std::vector<Edit> edits = desk->takeEdits();
        idle_ = edits.empty() && !simulation.stepUnderWay();
        FrameResult result = simulation.step(false, std::move(edits));
        const std::size_t changes = result.commit.list ? result.commit.list->changeCount() : 0;
        server.take(desk->committed(std::move(result), number, {}));
        number = number.next();
        return changes;
    }
    std::vector<message::Reply> replies() { return server.sent<message::Reply>(application); }
    answer::Committed committed(std::size_t which) {
        const auto all = replies();
        if (all.size() <= which) return {};
        EXPECT_EQ(all[which].error, "");
        return std::get<answer::Committed>(decodeAnswer(all[which].body).value());
    }

    Wall wall = test::wallOfOne();
    BlobStore blobs;
    ServerFixture server;
    Simulation simulation;
    ViewSource view{wall, ""};
    Loader loader{{}, {}, [](Preparation) {}};
    ManipulatorDrags drags;
    std::vector<Preparation> orders;
    std::unique_ptr<RequestDesk> desk;
    ConnectionId application;
    std::uint64_t asked = 0;
    FrameNumber number;

private:
    bool idle_ = false;
};

TEST(Copies, LargeOnesComeInPartsAndAreTheSame) {
    constexpr std::size_t kNodes = 10'000;
    DeskWithFrames beside(true), atOnce(false);
    const ObjectId group = beside.group(kNodes);
    ASSERT_EQ(atOnce.group(kNodes), group);
    const std::size_t before = beside.simulation.scene().objectCount();
    for (DeskWithFrames* one : {&beside, &atOnce}) {
        one->ask(request::CloneNode{{.node = group, .name = "second", .deep = true}});
        one->ask(request::CloneNode{{.node = group, .name = "third", .deep = true}});
    }
    EXPECT_EQ(beside.orders.size(), 1u) << "one at a time";
    beside.copy();
    EXPECT_EQ(beside.orders.size(), 1u);
    beside.copy();
    EXPECT_LE(beside.frames(), 2 * LoadPartLimits().changes);
    EXPECT_GT(atOnce.frames(), 3 * kNodes);
    EXPECT_EQ(beside.simulation.scene().stateHash(), atOnce.simulation.scene().stateHash());
    ASSERT_EQ(beside.replies().size(), 2u);
    for (std::size_t which : {0u, 1u}) {
        const answer::Committed told = beside.committed(which), expected = atOnce.committed(which);
        EXPECT_EQ(told.ids, expected.ids);
        EXPECT_EQ(told.created, expected.created);
        ASSERT_EQ(told.ids.size(), 1u);
        EXPECT_EQ(told.ids[0].second, findNode(beside.simulation.scene(), which == 0 ? "/second" : "/third").value());
    }
    // Each is one step, in both directions.
    const StateHash both = beside.simulation.scene().stateHash();
    EXPECT_EQ(beside.simulation.history().undoDepth(), 2u);
    for (int i = 0; i < 2; ++i) {
        beside.ask(request::UndoStep{});
        (void)beside.frames();
    }
    EXPECT_EQ(beside.simulation.scene().objectCount(), before);
    for (int i = 0; i < 2; ++i) {
        beside.ask(request::RedoStep{});
        EXPECT_LE(beside.frames(), 2 * LoadPartLimits().changes);
    }
    EXPECT_EQ(beside.simulation.scene().stateHash(), both);
}

TEST(Copies, SmallOnesAreMadeAtOnce) {
    DeskWithFrames beside(true);
    beside.ask(request::CloneNode{{.node = beside.group(100), .deep = true}});
    EXPECT_TRUE(beside.orders.empty());
    (void)beside.frames();
    EXPECT_EQ(beside.committed(0).created, 200u);
    EXPECT_EQ(beside.committed(0).ids.size(), 1u);
}

TEST(Copies, OneThatIsTooLargeOrHasNowhereToStandIsRefusedInWords) {
    DeskWithFrames beside(true);
    const ObjectId group = beside.group(3'000);
    beside.ask(request::CloneNode{{.node = group, .deep = true}});
    ASSERT_EQ(beside.orders.size(), 1u);
    beside.orders[0].copy->maxChanges = 2'000;
    beside.copy();
    ASSERT_EQ(beside.replies().size(), 1u);
    EXPECT_WORDS(beside.replies()[0].error);
    // Whatever it was to stand below has gone meanwhile.
    test::ListMaker make;
    make.node("shelf", kRootNode);
    Edit shelf{.list = make.builder.take()};
    std::vector<Edit> edits;
    edits.push_back(std::move(shelf));
    (void)beside.simulation.step(false, std::move(edits));
    const std::size_t before = beside.simulation.scene().objectCount();
    const ObjectId under = findNode(beside.simulation.scene(), "/shelf").value();
    beside.ask(request::CloneNode{{.node = group, .under = under, .deep = true}});
    beside.copy();
    beside.ask(request::RemoveNode{.node = under});
    (void)beside.frames();
    ASSERT_EQ(beside.replies().size(), 3u);
    EXPECT_EQ(std::ranges::count_if(beside.replies(), [](const message::Reply& reply) { return reply.error.empty(); }),
              1)
        << "the shelf has gone";
    EXPECT_EQ(beside.simulation.scene().objectCount(), before - 1) << "what had come is taken away again";
}

TEST(Copies, AnUndoWhileOneAppearsWaitsUntilItIsThere) {
    DeskWithFrames beside(true);
    const ObjectId group = beside.group(20'000);
    const std::size_t before = beside.simulation.scene().objectCount();
    beside.ask(request::CloneNode{{.node = group, .deep = true}});
    beside.copy();
    for (int i = 0; i < 100 && !beside.simulation.appearing(); ++i) (void)beside.frame();
    ASSERT_TRUE(beside.simulation.appearing());
    beside.ask(request::UndoStep{});
    EXPECT_LE(beside.frames(), LoadPartLimits().changes);
    EXPECT_EQ(beside.committed(0).created, 40'000u);
    EXPECT_GT(beside.committed(1).sequence, beside.committed(0).sequence);
    EXPECT_EQ(beside.simulation.scene().objectCount(), before);
}

TEST(Copies, WhoLeavesGetsNoAnswerAndTheCopyIsWhole) {
    DeskWithFrames beside(true);
    const ObjectId group = beside.group(3'000);
    const std::size_t before = beside.simulation.scene().objectCount();
    beside.ask(request::CloneNode{{.node = group, .deep = true}});
    beside.copy();
    std::vector<Edit> first = beside.desk->takeEdits();
    (void)beside.simulation.step(false, std::move(first));
    beside.server.drop(beside.application);
    beside.desk->applicationLeft(beside.application);
    (void)beside.frames();
    EXPECT_EQ(beside.simulation.scene().objectCount(), 2 * before - 1) << "all but the root";
}

}  // namespace
}  // namespace tessera
