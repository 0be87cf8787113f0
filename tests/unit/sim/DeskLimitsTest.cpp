// What one application may have open, and that it is no other one's affair.
#include <gtest/gtest.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

/// A desk for which no frame comes.
class DeskLimits : public test::DeskStage {
protected:
    ConnectionId join(const std::string& name) {
        const ConnectionId connection = server.hello(name, PeerRole::kApplication);
        desk.applicationJoined(connection);
        return connection;
    }
    void leave(ConnectionId connection) {
        server.drop(connection);
        desk.applicationLeft(connection);
    }
    /// Nothing where the answer is still to come, else its error; empty where it is good.
    std::optional<std::string> ask(ConnectionId connection, const ApplicationRequest& request) {
        server.forget();
        server.take(desk.received({connection, "somebody", ++asked, share(encodeRequest(request))}, server.now));
        const auto replies = server.sent<message::Reply>(connection);
        return replies.empty() ? std::nullopt : std::optional(replies[0].error);
    }
    static request::ProposeChanges proposal(std::size_t blobBytes = 0) {
        test::ListMaker maker;
        maker.node("n", kRootNode);
        request::ProposeChanges propose{.list = share(encodeChangeList(maker.builder.take()))};
        if (blobBytes > 0) propose.blobs.push_back(share(Bytes(blobBytes)));
        return propose;
    }

    RequestDesk::Limits limits{.maxOpenRequests = 10, .maxOpenBytes = 1000, .maxLeftBehind = 15, .maxFrameChanges = 50};
    RequestDesk desk{around(), limits};
    [[nodiscard]] DeskSurroundings around() {
        DeskSurroundings all = surroundings();
        all.orderCopy = [this](Preparation order) { copies.push_back(std::move(order)); };
        return all;
    }
    std::uint64_t asked = 0;
    std::vector<Preparation> copies;  ///< that are to be made
};

TEST_F(DeskLimits, WhoAsksWithoutEndIsRefusedAndNobodyElseIs) {
    const ConnectionId greedy = join("greedy"), other = join("other");
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(ask(greedy, request::UndoStep{}));
    EXPECT_WORDS(ask(greedy, request::UndoStep{}).value_or(""));
    EXPECT_WORDS(ask(greedy, proposal()).value_or(""));
    EXPECT_EQ(ask(greedy, request::GetStatus{}), "") << "what is answered at once waits for nothing";
    EXPECT_EQ(ask(other, request::GetStatus{}), "");
    EXPECT_FALSE(ask(other, proposal()));
}

TEST_F(DeskLimits, ManyEditsOpenSeveralFramesInTheirOrder) {
    const std::array<ConnectionId, 3> all{join("one"), join("two"), join("three")};
    for (std::size_t i = 0; i < 21; ++i) EXPECT_FALSE(ask(all[i % all.size()], proposal()));
    std::vector<std::uint64_t> tickets;
    int frames = 0;
    for (std::vector<Edit> edits = desk.takeEdits(); !edits.empty(); edits = desk.takeEdits(), ++frames) {
        std::size_t changes = 0;
        for (const Edit& edit : edits) {
            tickets.push_back(edit.ticket);
            changes += edit.list.changeCount();
        }
        EXPECT_TRUE(edits.size() == 1 || changes <= limits.maxFrameChanges) << changes;
    }
    EXPECT_GT(frames, 1);
    EXPECT_EQ(tickets.size(), 21u);
    EXPECT_TRUE(std::ranges::is_sorted(tickets));
}

TEST_F(DeskLimits, ProposalsThatWaitAreBoundedInBytes) {
    const ConnectionId greedy = join("greedy"), other = join("other");
    EXPECT_FALSE(ask(greedy, proposal(2000)));
    EXPECT_WORDS(ask(greedy, proposal()).value_or(""));
    EXPECT_FALSE(ask(other, proposal()));
}

TEST_F(DeskLimits, CopiesCountByWhatTheyHoldAndNoneIsMadeBeforeThereIsRoom) {
    test::ListMaker maker;
    const ObjectId forest = maker.node("forest", kRootNode);
    for (int i = 0; i < 1'000; ++i) maker.node("tree", forest);
    std::vector<ChangeList> lists;
    lists.push_back(maker.builder.take());
    ASSERT_TRUE(simulation.load(std::move(lists)));
    const ObjectId node = simulation.scene().root().children.front();
    const ConnectionId greedy = join("greedy"), other = join("other");
    for (int i = 0; i < 2; ++i)
        EXPECT_FALSE(ask(greedy, request::CloneNode{{.node = node, .under = kRootNode, .name = "copy", .deep = true}}));
    ASSERT_EQ(copies.size(), 1u) << "one at a time";
    server.take(desk.prepared(makeCopy(simulation.scene(), copies[0]), server.now));
    EXPECT_EQ(copies.size(), 1u) << "the first one holds more than all may";
    EXPECT_WORDS(ask(greedy, proposal()).value_or(""));
    EXPECT_FALSE(ask(other, proposal()));
    // A copy that is made at once counts too.
    const ObjectId tree = simulation.scene().get<Node>(node)->children.front();
    for (int i = 0; i < 7; ++i)
        (void)ask(other, request::CloneNode{{.node = tree, .under = kRootNode, .name = "copy", .deep = true}});
    EXPECT_WORDS(ask(other, proposal()).value_or(""));
    // Once it is in the scene the next one is made.
    FrameResult result;
    result.commit.sent = listAt(Sequence(6));
    std::uint64_t ticket = 0;
    for (int frame = 0; frame < 20 && ticket == 0; ++frame)
        for (const Edit& edit : desk.takeEdits())
            if (edit.ticket == copies[0].ticket) ticket = edit.ticket;
    ASSERT_NE(ticket, 0u);
    result.outcomes.push_back({.ticket = ticket, .result = answer::Committed{.ids = {{kRootNode, kRootNode}}}});
    (void)desk.committed(std::move(result), FrameNumber(1), {});
    EXPECT_EQ(copies.size(), 2u);
}

TEST_F(DeskLimits, WhoComesAndGoesLeavesABoundedNumberBehind) {
    for (int round = 0; round < 20; ++round) {
        const ConnectionId guest = join("guest");
        for (int i = 0; i < 5; ++i) EXPECT_FALSE(ask(guest, proposal()));
        leave(guest);
    }
    EXPECT_EQ(desk.takeEdits().size(), 15u);
}

}  // namespace
}  // namespace tessera
