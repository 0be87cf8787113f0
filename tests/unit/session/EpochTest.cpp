// Which start of a server a message belongs to: compared by both sides, and never lower than what was seen before.
#include <gtest/gtest.h>

#include "common/session/ClientSession.h"
#include "tests/support/words/Words.h"
#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

ServerSessionConfig at(Epoch epoch) {
    ServerSessionConfig config = twoHosts();
    config.epoch = epoch;
    return config;
}

/// A host that has seen `epoch` says hello.
ConnectionId helloAfter(ServerFixture& s, const std::string& name, Epoch epoch) {
    const ConnectionId connection = s.open();
    message::Hello hello = s.greeting(name);
    hello.seenEpoch = epoch;
    s.say(connection, hello);
    return connection;
}

std::string refusal(const ServerFixture& s, ConnectionId connection) {
    const auto refused = s.sent<message::Refused>(connection);
    return refused.empty() ? "" : refused.back().reason;
}

TEST(Epochs, AServerClosesWhoSpeaksOfAnotherOneAndNamesBoth) {
    for (const Epoch other : {6_epoch, 8_epoch, 0_epoch}) {
        ServerFixture s(at(7_epoch));
        const ConnectionId a = s.join("a");
        const ConnectionId b = s.join("b");
        const FrameNumber frame = s.begin();
        s.take(s.session.received(a, other, message::Ready{frame, hashAfter(s.sequence), nullptr}, s.now));
        EXPECT_TRUE(s.closed(a));
        EXPECT_WORDS(refusal(s, a));
        EXPECT_FALSE(s.closed(b));
    }
}

TEST(Epochs, AServerClosesABulkConnectionOfAnotherOne) {
    ServerFixture s(at(7_epoch));
    const ConnectionId a = s.hello("a");
    const ConnectionId bulk = s.bulk(a);
    s.take(s.session.received(bulk, 6_epoch, message::BlobRequest{.id = blobOf("x").id, .length = 10}, s.now));
    EXPECT_TRUE(s.closed(bulk));
    EXPECT_TRUE(s.actions<server_action::BlobRequested>().empty());
}

TEST(Epochs, APeerThatWasNotWelcomedYetNeedsToKnowNone) {
    ServerFixture s(at(7_epoch));
    const ConnectionId a = s.hello("a");
    s.take(s.session.received(a, {}, message::Heartbeat{.sentAtNs = 1}, s.now));  // sent before the Welcome came
    EXPECT_FALSE(s.closed(a));
}

TEST(Epochs, WhatNoClockGivesRaisesNothing) {
    for (const std::uint64_t far : {(std::uint64_t{1} << 63) + 1, ~std::uint64_t{0} - 1, ~std::uint64_t{0}}) {
        ServerFixture s(at(7_epoch));
        const ConnectionId liar = helloAfter(s, "a", Epoch(far));
        EXPECT_TRUE(s.closed(liar));
        EXPECT_WORDS(refusal(s, liar));
        EXPECT_EQ(s.session.epoch(), 7_epoch);
        EXPECT_FALSE(s.closed(s.hello("a"))) << "the name is free for its host";
    }
}

/// A stranger says a host's name before any host has come.
TEST(Epochs, WhoeverRaisesItAsFarAsItGoesShutsNoHostOutOfTheNextServer) {
    Epoch seen;
    for (std::uint64_t start = 7; start < 12; ++start) {
        ServerSessionConfig config = at(Epoch(start));
        config.furthestSeen = Epoch(start + 1000);
        ServerFixture s(config);
        if (seen) EXPECT_FALSE(s.closed(helloAfter(s, "b", seen))) << "it was welcomed by the server before";
        const ConnectionId beyond = helloAfter(s, "a", config.furthestSeen.next());
        EXPECT_EQ(s.closed(beyond), config.furthestSeen.next() > s.session.epoch());
        if (!s.closed(beyond)) s.drop(beyond);
        const ConnectionId stranger = helloAfter(s, "a", config.furthestSeen);
        EXPECT_FALSE(s.closed(stranger));
        s.drop(stranger);
        const ConnectionId a = s.hello("a");
        seen = s.sent<message::Welcome>(a).back().epoch;
        EXPECT_GT(seen, config.furthestSeen);
    }
}

TEST(Epochs, AServerWhoseClockWentBackGoesAboveWhatItsHostsHaveSeen) {
    ServerFixture s(at(7_epoch));
    const ConnectionId a = helloAfter(s, "a", 100_epoch);
    ASSERT_EQ(s.actions<server_action::EpochRaised>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::EpochRaised>()[0].from, 7_epoch);
    EXPECT_EQ(s.session.epoch(), 101_epoch);
    EXPECT_EQ(s.sent<message::Welcome>(a).at(0).epoch, 101_epoch);
    // The others have seen the same, and need no more.
    const ConnectionId b = helloAfter(s, "b", 100_epoch);
    EXPECT_EQ(s.sent<message::Welcome>(b).at(0).epoch, 101_epoch);
    EXPECT_FALSE(s.closed(a));
}

TEST(Epochs, WhoWasWelcomedBeforeItRoseStartsOver) {
    ServerFixture s(at(7_epoch));
    const ConnectionId fresh = s.join("b");  // this one has seen nothing
    const ConnectionId viewer = s.follow("viewer");
    const ConnectionId a = helloAfter(s, "a", 100_epoch);
    for (const ConnectionId early : {fresh, viewer}) {
        EXPECT_TRUE(s.closed(early));
        ASSERT_EQ(s.sent<message::Refused>(early).size(), 1u);
        EXPECT_TRUE(s.sent<message::Refused>(early)[0].retry);
    }
    s.snapshot(a);
    s.synced(a);
    s.join("b");
    EXPECT_TRUE(s.session.mayBegin(s.now)) << "and the wall starts";
}

TEST(Epochs, AServerThatHasShownPicturesDoesNotOutbidOneThatTookOver) {
    ServerFixture s(at(7_epoch));
    const ConnectionId a = s.join("a");
    s.join("b");
    s.begin();
    s.drop(a);
    const ConnectionId back = helloAfter(s, "a", 9_epoch);  // it was welcomed elsewhere meanwhile
    EXPECT_EQ(s.session.epoch(), 7_epoch);
    EXPECT_TRUE(s.closed(back));
    EXPECT_WORDS(refusal(s, back));
    EXPECT_NE(s.state("a"), HostState::kJoining);
}

TEST(Epochs, NeitherAnApplicationNorTheLastNumberThereIsRaisesIt) {
    ServerFixture s(at(7_epoch));
    const ConnectionId viewer = s.open();
    message::Hello hello = s.greeting("viewer", PeerRole::kApplication);
    hello.seenEpoch = 100_epoch;
    s.say(viewer, hello);
    EXPECT_EQ(s.session.epoch(), 7_epoch);
    const ConnectionId a = helloAfter(s, "a", Epoch(~0ull));
    EXPECT_EQ(s.session.epoch(), 7_epoch);
    EXPECT_TRUE(s.closed(a));
}

// ---- the other side

ClientActions welcomedAt(ClientSession& client, Epoch epoch) {
    (void)client.channelOpened(ChannelKind::kControl, TimePoint(1s));
    return client.received(ChannelKind::kControl, epoch, message::Welcome{.epoch = epoch}, TimePoint(1s));
}
const client_action::Disconnect* disconnectIn(const ClientActions& actions) {
    for (const ClientAction& action : actions)
        if (const auto* left = std::get_if<client_action::Disconnect>(&action)) return left;
    return nullptr;
}

TEST(Epochs, AHostLeavesAServerThatIsOlderThanOneItHasSeen) {
    ClientSession client({.name = "a", .seenEpoch = 9_epoch});
    const ClientActions actions = welcomedAt(client, 8_epoch);
    const auto* left = disconnectIn(actions);
    ASSERT_NE(left, nullptr);
    EXPECT_TRUE(left->retry);
    EXPECT_WORDS(left->reason);
}

TEST(Epochs, AHostComesBackToTheSameServer) {
    ClientSession client({.name = "a", .seenEpoch = 9_epoch});
    const ClientActions actions = welcomedAt(client, 9_epoch);
    EXPECT_EQ(disconnectIn(actions), nullptr);
    EXPECT_EQ(client.epoch(), 9_epoch);
}

TEST(Epochs, AHostRefusesMessagesOfAnotherOneAndNamesBoth) {
    for (const Message& message :
         {Message(message::Swap{3_frame}), Message(message::Over{"no"}), Message(message::Heartbeat{1, 2, 3})}) {
        ClientSession client({.name = "a"});
        (void)welcomedAt(client, 9_epoch);
        const ClientActions actions = client.received(ChannelKind::kControl, 8_epoch, message, TimePoint(1s));
        const auto* left = disconnectIn(actions);
        ASSERT_NE(left, nullptr) << nameOf(message);
        EXPECT_WORDS(left->reason);
    }
}

}  // namespace
}  // namespace tessera
