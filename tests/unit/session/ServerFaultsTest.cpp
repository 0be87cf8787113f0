// What goes wrong with one host, and that it does not go wrong with the others.
#include "tests/support/words/Words.h"
#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

struct Live : ServerFixture {
    explicit Live(ServerSessionConfig config = twoHosts()) : ServerFixture(config) {
        a = join("a");
        b = join("b");
        ready(a, begin());
        ready(b, 0_frame);
        take(session.advance(now));
        for (const ConnectionId c : {a, b}) show(c);
        forget();
    }
    /// Another frame, which both have drawn and are told to show.
    FrameNumber drawn() {
        const FrameNumber frame = begin();
        ready(a, frame);
        ready(b, frame);
        take(session.advance(now));
        return frame;
    }
    ConnectionId a, b;
};

TEST(ServerFaults, AHostThatIsSilentIsLost) {
    Live s;
    const FrameNumber frame = s.begin();
    s.ready(s.a, frame);
    s.run(240ms, {s.a});
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    s.run(20ms, {s.a});
    const auto faults = s.actions<server_action::Fault>();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].host, "b");
    EXPECT_EQ(faults[0].kind, FaultKind::kSilent);
    EXPECT_EQ(faults[0].detectedAfter, 250ms);
    EXPECT_TRUE(s.closed(s.b));
    EXPECT_EQ(s.state("b"), HostState::kLost);
    EXPECT_EQ(s.sent<message::Swap>(s.a).size(), 1u);
}

TEST(ServerFaults, AnyByteIsASignOfLife) {
    Live s;
    const ConnectionId bulk = [&] {
        ServerFixture& f = s;
        f.drop(s.b);
        s.b = f.join("b");
        return f.bulk(s.b);
    }();
    for (int i = 0; i < 5; ++i) {
        s.run(200ms, {s.a});
        s.say(bulk, message::BlobRequest{.id = blobOf("x").id, .length = 1});
    }
    EXPECT_FALSE(s.closed(s.b));
}

TEST(ServerFaults, EventsFromBeforeALateLookAtTheClockCount) {
    Live s;
    for (int i = 0; i < 20; ++i) {
        s.pass(50ms);
        for (const ConnectionId c : {s.a, s.b}) s.say(c, message::Heartbeat{.sentAtNs = 1});
    }
    s.take(s.session.advance(s.now));  // for the first time in a second
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
}

TEST(ServerFaults, AfterAStandstillOfOurOwnHostsGetAMoment) {
    Live s;
    s.pass(3s);
    s.take(s.session.advance(s.now));
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    s.say(s.a, message::Heartbeat{.sentAtNs = 1});  // lay in the queue
    s.run(60ms, {s.a});
    ASSERT_EQ(s.actions<server_action::Fault>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::Fault>()[0].host, "b");
}

TEST(ServerFaults, AStandstillOfTheWholeProcessIsSeenInTheEventsToo) {
    Live s;
    s.pass(3s);
    s.say(s.a, message::Heartbeat{.sentAtNs = 1});  // the first that is read afterwards
    s.take(s.session.advance(s.now));
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    s.say(s.b, message::Heartbeat{.sentAtNs = 1});
    s.run(100ms);
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
}

TEST(ServerFaults, ACallerThatIsAlwaysSlowStillFindsASilentHost) {
    Live s;
    s.drop(s.b);
    s.forget();
    for (int i = 0; i < 6; ++i) {
        s.pass(200ms);
        s.take(s.session.advance(s.now));
    }
    ASSERT_EQ(s.actions<server_action::Fault>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::Fault>()[0].kind, FaultKind::kSilent);
}

TEST(ServerFaults, ASlowCallerThatHasReadWhatTheOthersSaidNeedsNoGrace) {
    Live s;
    for (int i = 0; i < 2; ++i) {
        for (int beat = 0; beat < 4; ++beat) {
            s.pass(50ms);
            s.say(s.a, message::Heartbeat{.sentAtNs = 1});
        }
        s.take(s.session.advance(s.now));  // every 200 ms only
    }
    ASSERT_EQ(s.actions<server_action::Fault>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::Fault>()[0].host, "b");
}

TEST(ServerFaults, OurOwnStandstillIsNotTakenFromTheTimeForBlobs) {
    ServerSessionConfig config = twoHosts();
    config.blobDeadline = 500ms;
    Live s(config);
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    s.pass(450ms);  // nobody serves chunks
    s.run(450ms, {s.a, s.b});
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    s.run(100ms, {s.a, s.b});
    EXPECT_EQ(s.actions<server_action::Fault>().size(), 2u);
}

TEST(ServerFaults, AReadyThatLayUnreadWhileWeStoodStillIsInTime) {
    ServerSessionConfig config = twoHosts();
    config.sync.lateFrame = LateFramePolicy::kHold;
    Live s(config);
    const FrameNumber frame = s.begin();
    s.ready(s.a, frame);
    s.run(110ms, {s.a, s.b});  // b is late, and held
    const TimePoint readyAt = s.now + 10ms;
    s.pass(3s);
    s.begin();  // before anything else is looked at
    s.take(s.session.received(s.b, s.session.epoch(), message::Ready{frame, hashAfter(s.sequence), nullptr}, readyAt));
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
}

TEST(ServerFaults, ARestartedHostComesBackThroughTheSamePath) {
    Live s;
    s.drop(s.b);
    s.pass(700ms);
    s.say(s.a, message::Heartbeat{.sentAtNs = 1});
    s.b = s.join("b");
    s.begin();
    const auto entered = s.actions<server_action::HostEntered>();
    ASSERT_EQ(entered.size(), 1u);
    EXPECT_TRUE(entered[0].rejoined);
    EXPECT_EQ(entered[0].awayFor, 700ms);
}

TEST(ServerFaults, WhoSaysWhatItMustNotSayIsClosedAlone) {
    const std::vector<Message> never{message::Hello{},
                                     message::Welcome{},
                                     message::Request{},
                                     message::TileImage{},
                                     message::BlobRequest{},
                                     message::HashAnswer{},
                                     message::Over{},
                                     message::Begin{},
                                     message::Ready{.frame = 99_frame},
                                     message::Shown{.frame = 99_frame},
                                     message::Synced{.sequence = 99_seq}};
    for (const Message& message : never) {
        Live s;
        s.say(s.b, message);
        const auto faults = s.actions<server_action::Fault>();
        ASSERT_EQ(faults.size(), 1u) << nameOf(message);
        EXPECT_EQ(faults[0].kind, FaultKind::kProtocol) << nameOf(message);
        EXPECT_TRUE(s.closed(s.b)) << nameOf(message);
        EXPECT_FALSE(s.closed(s.a)) << nameOf(message);
        s.ready(s.a, s.begin());
        EXPECT_EQ(s.sent<message::Swap>(s.a).size(), 1u) << nameOf(message);
    }
}

TEST(ServerFaults, BytesThatAreNoMessageCloseTheirSender) {
    Live s;
    s.take(s.session.malformed(s.b, "wrong checksum", s.now));
    ASSERT_EQ(s.actions<server_action::Fault>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::Fault>()[0].detail, "wrong checksum");
    const ConnectionId stranger = s.open();
    s.take(s.session.malformed(stranger, "not a Tessera peer", s.now));
    EXPECT_TRUE(s.closed(stranger));
    EXPECT_EQ(s.actions<server_action::Fault>().size(), 1u);
}

TEST(ServerFaults, AnApplicationThatMisbehavesLeavesTheWallAlone) {
    Live s;
    const ConnectionId app = s.follow("viewer");
    s.say(app, message::Ready{0_frame, 0_hash, nullptr});
    EXPECT_TRUE(s.closed(app));
    EXPECT_EQ(s.actions<server_action::ApplicationLeft>().size(), 1u);
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
}

TEST(ServerFaults, AGreedyChunkRequestIsRefused) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    const ConnectionId bulk = s.bulk(a);
    s.say(bulk, message::BlobRequest{.id = blobOf("x").id, .length = 0xffffffffu});
    EXPECT_TRUE(s.closed(a));
    EXPECT_TRUE(s.closed(bulk));
    EXPECT_TRUE(s.actions<server_action::BlobRequested>().empty());
}

TEST(ServerFaults, AWrongReplicaIsNamedQueriedAndRepaired) {
    Live s;
    const FrameNumber frame = s.begin(s.commit());
    const Sequence stands = s.sequence;
    s.ready(s.a, frame);
    s.say(s.b, message::Ready{frame, 666_hash, nullptr});
    const auto mismatch = s.actions<server_action::StateMismatch>();
    ASSERT_EQ(mismatch.size(), 1u);
    EXPECT_EQ(mismatch[0].host, "b");
    EXPECT_EQ(mismatch[0].expected, hashAfter(s.sequence));
    EXPECT_EQ(mismatch[0].actual, 666_hash);
    EXPECT_EQ(mismatch[0].sequence, s.sequence);
    ASSERT_EQ(s.actions<server_action::Fault>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::Fault>()[0].kind, FaultKind::kStateMismatch);
    const auto released = s.actions<server_action::FrameReleased>();
    ASSERT_EQ(released.size(), 1u);
    EXPECT_EQ(released[0].shown, Names{"a"});
    EXPECT_EQ(released[0].held, Names{"b"});  // its picture may be wrong
    ASSERT_EQ(s.sent<message::HashQuery>(s.b).size(), 1u);

    s.say(s.b, message::HashAnswer{.sequence = s.sequence, .entries = {{1, 2}}});
    ASSERT_EQ(s.actions<server_action::HashesReceived>().size(), 1u);
    s.take(s.session.queryObjects("b", 1));
    EXPECT_EQ(s.sent<message::HashQuery>(s.b).size(), 2u);
    s.ready(s.a, s.begin(s.commit()));
    EXPECT_TRUE(s.sent<message::Changes>(s.b).empty());  // it stands still while it is looked at
    s.say(s.b, message::HashAnswer{.sequence = stands, .objects = true});
    EXPECT_EQ(s.actions<server_action::HashesReceived>().size(), 2u);

    s.take(s.session.repair("b", s.now));
    EXPECT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
    s.snapshot(s.b);
    s.synced(s.b);
    s.forget();
    s.begin();
    EXPECT_EQ(s.actions<server_action::HostEntered>().size(), 1u);
    EXPECT_EQ(s.sent<message::Begin>(s.b).size(), 1u);
    // Whoever looks for what differed may be late: what is well stays where it is.
    s.take(s.session.repair("b", s.now));
    EXPECT_EQ(s.actions<server_action::SnapshotWanted>().size(), 0u);
    EXPECT_EQ(s.state("b"), HostState::kLive);
}

/// Draws a frame in which `b` says a wrong hash; it is in the barrier again before it.
void liesOnce(Live& s) {
    ASSERT_EQ(s.state("b"), HostState::kLive);
    const FrameNumber frame = s.begin(s.commit());
    s.ready(s.a, frame);
    s.say(s.b, message::Ready{frame, 666_hash, nullptr});
    s.show(s.a);
}

void isRepaired(Live& s) {
    s.take(s.session.repair("b", s.now));
    s.snapshot(s.b);
    s.synced(s.b);
    const FrameNumber frame = s.begin();
    s.ready(s.a, frame);
    s.ready(s.b, frame);
    s.show(s.a);
    s.show(s.b);
}

TEST(ServerFaults, AHostWhoseHashIsWrongAThirdTimeIsSentAwayInWords) {
    Live s;
    for (int i = 0; i < 2; ++i) {
        liesOnce(s);
        EXPECT_FALSE(s.closed(s.b)) << i;
        isRepaired(s);
    }
    s.forget();
    liesOnce(s);
    EXPECT_TRUE(s.closed(s.b));
    EXPECT_EQ(s.state("b"), HostState::kLost);
    const auto refused = s.sent<message::Refused>(s.b);
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_FALSE(refused[0].retry) << "it would come back by itself";
    EXPECT_WORDS(refused[0].reason);
    const auto faults = s.actions<server_action::Fault>();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].kind, FaultKind::kStateMismatch);
    EXPECT_WORDS(faults[0].detail);
    EXPECT_TRUE(s.actions<server_action::StateMismatch>().empty()) << "nobody needs to look any more";
    const auto released = s.actions<server_action::FrameReleased>();
    ASSERT_EQ(released.size(), 1u);
    EXPECT_EQ(released[0].shown, Names{"a"});
    EXPECT_EQ(released[0].held, Names{"b"});
    // Somebody has started it again, and nothing is better.
    s.forget();
    s.b = s.hello("b");
    s.snapshot(s.b);
    EXPECT_FALSE(s.closed(s.b));
    s.say(s.b, message::Synced{s.sequence, 666_hash});
    EXPECT_TRUE(s.closed(s.b));
}

TEST(ServerFaults, AHostWhoseHashIsWrongNowAndThenIsRepairedEachTime) {
    Live s;
    for (int i = 0; i < 10; ++i) {
        liesOnce(s);
        ASSERT_FALSE(s.closed(s.b)) << i;
        isRepaired(s);
        s.run(31s, {s.a, s.b});
    }
}

TEST(ServerFaults, AHostThatDescribesItselfWhereItCannotBeIsClosed) {
    Live s;
    const FrameNumber frame = s.begin(s.commit());
    s.say(s.b, message::Ready{frame, 666_hash, nullptr});
    s.say(s.b, message::HashAnswer{.sequence = s.sequence.next(), .entries = {{1, 2}}});
    EXPECT_TRUE(s.closed(s.b));
    EXPECT_TRUE(s.actions<server_action::HashesReceived>().empty());
}

TEST(ServerFaults, AMismatchNobodyLooksAtEndsAtTheSyncDeadline) {
    ServerSessionConfig config = twoHosts();
    config.syncDeadline = 500ms;
    Live s(config);
    s.ready(s.a, s.begin());
    s.say(s.b, message::Ready{1_frame, 666_hash, nullptr});
    s.run(510ms, {s.a, s.b});
    EXPECT_TRUE(s.closed(s.b));
    EXPECT_FALSE(s.closed(s.a));
}

TEST(ServerFaults, AHostThatLivesAndDoesNotShowIsOutAndNamedUntilItDoes) {
    Live s;
    const FrameNumber frame = s.drawn();
    s.show(s.a);
    s.showing = false;
    s.run(240ms, {s.a, s.b});
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    EXPECT_FALSE(s.session.mayBegin(s.now)) << "it is waited for";
    s.run(20ms, {s.a, s.b});
    const auto faults = s.actions<server_action::Fault>();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].host, "b");
    EXPECT_EQ(faults[0].kind, FaultKind::kNotShown);
    EXPECT_WORDS(faults[0].detail);
    EXPECT_TRUE(s.session.mayBegin(s.now));
    EXPECT_EQ(s.state("b"), HostState::kLost);
    EXPECT_FALSE(s.closed(s.b)) << "a new connection would let it in again";
    s.forget();
    for (int i = 0; i < 5; ++i) {
        ASSERT_TRUE(s.session.mayBegin(s.now)) << i;
        s.ready(s.a, s.begin(s.commit()));
        s.show(s.a);
        s.run(2s, {s.a, s.b});
    }
    EXPECT_TRUE(s.sent<message::Begin>(s.b).empty());
    EXPECT_TRUE(s.sent<message::Changes>(s.b).empty());
    EXPECT_TRUE(s.actions<server_action::Fault>().empty()) << "it has held the others up once";
    s.say(s.b, message::Shown{frame, 1});
    EXPECT_EQ(s.actions<server_action::FrameShown>().size(), 5u) << "an old picture is no matter of the others";
    ASSERT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
    s.snapshot(s.b);
    s.synced(s.b);
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(s.b).size(), 1u);
    ASSERT_EQ(s.actions<server_action::HostEntered>().size(), 1u);
    EXPECT_TRUE(s.actions<server_action::HostEntered>()[0].rejoined);
}

TEST(ServerFaults, WhatAHostShowsWhileTheServerStandsStillIsHeardBeforeItIsCondemned) {
    Live s;
    s.drawn();
    s.show(s.a);
    s.pass(400ms);
    s.take(s.session.advance(s.now));  // its word lies unread
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    EXPECT_FALSE(s.session.mayBegin(s.now));
    s.show(s.b);
    s.run(100ms, {s.a, s.b});
    EXPECT_TRUE(s.actions<server_action::Fault>().empty());
    EXPECT_TRUE(s.session.mayBegin(s.now));
}

TEST(ServerFaults, ASyncedHostWithAnotherHashIsAMismatch) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    s.snapshot(a);
    s.say(a, message::Synced{s.sequence, 666_hash});
    EXPECT_EQ(s.actions<server_action::StateMismatch>().size(), 1u);
    EXPECT_FALSE(s.session.mayBegin(s.now));
}

TEST(ServerFaults, MeasuresTheRoundTrip) {
    Live s;
    s.run(60ms);
    const auto beats = s.sent<message::Heartbeat>(s.a);
    ASSERT_FALSE(beats.empty());
    const Duration sentAgo = Duration(s.now.time_since_epoch().count() - beats.back().sentAtNs);
    s.pass(4ms);
    s.say(s.a, message::Heartbeat{.sentAtNs = 5, .echoNs = beats.back().sentAtNs, .heldNs = Duration(1ms).count()});
    EXPECT_EQ(s.session.hosts()[0].roundTrip, sentAgo + 3ms);
}

TEST(ServerFaults, AHeartbeatIsNeverTheAnswerToAnEvent) {
    ServerFixture s;
    const ConnectionId a = s.hello("a");
    s.say(a, message::Heartbeat{.sentAtNs = 1});  // came some time ago: what is said now must not carry that instant
    EXPECT_TRUE(s.sent<message::Heartbeat>(a).empty());
    EXPECT_LE(s.session.nextDeadline(), s.now);
    s.pass(7ms);
    s.take(s.session.advance(s.now));
    ASSERT_EQ(s.sent<message::Heartbeat>(a).size(), 1u);
    EXPECT_EQ(s.sent<message::Heartbeat>(a)[0].sentAtNs, s.now.time_since_epoch().count());
    EXPECT_EQ(s.sent<message::Heartbeat>(a)[0].heldNs, Duration(7ms).count());
}

TEST(ServerFaults, ImpossibleTimesInHeartbeatsAreIgnored) {
    Live s;
    constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
    constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
    for (const auto& [sent, echo, held] : {std::tuple{kMost, kMost, kMost},
                                           {kLeast, kLeast, kLeast},
                                           {1l, 1l, kLeast},
                                           {kLeast, kMost, 0l},
                                           {0l, kLeast, kMost}})
        s.say(s.a, message::Heartbeat{sent, echo, held});
    EXPECT_EQ(s.session.hosts()[0].roundTrip, 0ms);
    EXPECT_FALSE(s.closed(s.a));
}

}  // namespace
}  // namespace tessera
