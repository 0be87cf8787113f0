// What one application may have open, and that it is no other one's affair.
#include <gtest/gtest.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/RequestDesk.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

/// A desk for which no frame comes.
class DeskLimits : public testing::Test {
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
    static request::Propose proposal(std::size_t blobBytes = 0) {
        test::ListMaker maker;
        maker.node("n", kRootNode);
        request::Propose propose{.list = share(encodeChangeList(maker.builder.take()))};
        if (blobBytes > 0) propose.blobs.push_back(share(Bytes(blobBytes)));
        return propose;
    }

    Wall wall = test::wallOfOne();
    BlobStore blobs;
    ServerFixture server;
    Simulation simulation;
    ViewSource view{wall, ""};
    Loader loader{{}, std::make_shared<SceneFiles>(ImportOptions(), std::vector<std::string>()), [](LoadFinished) {}};
    ManipulatorDrags drags;
    RequestDesk::Limits limits{.maxOpenRequests = 10, .maxOpenBytes = 1000, .maxLeftBehind = 15, .maxFrameChanges = 50};
    RequestDesk desk{{.wall = wall,
                      .blobs = blobs,
                      .session = server.session,
                      .simulation = simulation,
                      .view = view,
                      .loader = loader,
                      .drags = drags},
                     limits};
    std::uint64_t asked = 0;
};

TEST_F(DeskLimits, WhoAsksWithoutEndIsRefusedAndNobodyElseIs) {
    const ConnectionId greedy = join("greedy"), other = join("other");
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(ask(greedy, request::Undo{}));
    EXPECT_NE(ask(greedy, request::Undo{}).value_or("").find("10 requests of this application"), std::string::npos);
    EXPECT_NE(ask(greedy, proposal()).value_or("").find("10 requests"), std::string::npos);
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
    EXPECT_NE(ask(greedy, proposal()).value_or("").find("wait already"), std::string::npos);
    EXPECT_FALSE(ask(other, proposal()));
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
