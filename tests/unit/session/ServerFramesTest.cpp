// Frames of hosts that are there, and the blobs that have to be there first.
#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

struct TwoLive : ServerFixture {
    explicit TwoLive(ServerSessionConfig config = twoHosts()) : ServerFixture(config) {
        a = join("a");
        b = join("b");
        ready(a, begin());
        ready(b, 0_frame);
        forget();
    }
    ConnectionId a, b;
};

ServerSessionConfig with(LateFramePolicy late) {
    ServerSessionConfig config = twoHosts();
    config.sync.lateFrame = late;
    return config;
}

TEST(ServerFrames, SwapsOnceEverybodyIsReady) {
    TwoLive s;
    const FrameNumber frame = s.begin(s.commit());
    EXPECT_EQ(s.sent<message::Begin>(s.a).size(), 1u);
    s.pass(10ms);
    s.ready(s.a, frame);
    EXPECT_TRUE(s.sent<message::Swap>(s.a).empty());
    EXPECT_EQ(s.session.waitingFor(), Names{"b"});
    s.pass(5ms);
    s.ready(s.b, frame);
    EXPECT_EQ(s.sent<message::Swap>(s.a), std::vector{message::Swap{frame}});
    EXPECT_EQ(s.sent<message::Swap>(s.b), std::vector{message::Swap{frame}});
    const auto released = s.actions<server_action::FrameReleased>();
    ASSERT_EQ(released.size(), 1u);
    EXPECT_EQ(released[0].shown, (Names{"a", "b"}));
    EXPECT_EQ(released[0].barrierTime, 5ms);
    EXPECT_EQ(released[0].frameTime, 15ms);
    EXPECT_EQ(released[0].lastHost, "b");
    s.show(s.a);
    EXPECT_FALSE(s.session.mayBegin(s.now)) << "b has not said that it shows it";
    s.show(s.b);
    EXPECT_TRUE(s.session.mayBegin(s.now));
}

TEST(ServerFrames, ReportsWhenAFrameWasShown) {
    TwoLive s;
    s.say(s.a, message::Shown{0_frame, 1234});
    ASSERT_EQ(s.actions<server_action::FrameShown>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::FrameShown>()[0].shownAtNs, 1234);
    EXPECT_EQ(s.session.hosts()[0].lastShown, 0_frame);
    EXPECT_TRUE(s.session.hosts()[0].everShown);
}

TEST(ServerFrames, WithoutHostsAFrameIsReleasedAtOnce) {
    ServerSessionConfig config = twoHosts();
    config.hosts.clear();
    ServerFixture s(config);
    EXPECT_TRUE(s.session.mayBegin(s.now));
    s.begin();
    EXPECT_EQ(s.actions<server_action::FrameReleased>().size(), 1u);
}

TEST(ServerFrames, ALostHostReleasesTheFrame) {
    TwoLive s;
    const FrameNumber frame = s.begin();
    s.ready(s.a, frame);
    s.drop(s.b);
    const auto faults = s.actions<server_action::Fault>();
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].kind, FaultKind::kDisconnected);
    EXPECT_EQ(faults[0].frame, frame);
    EXPECT_EQ(s.sent<message::Swap>(s.a).size(), 1u);
    EXPECT_EQ(s.actions<server_action::FrameReleased>()[0].shown, Names{"a"});
}

TEST(ServerFrames, HoldSendsTheListsButNoFrameUntilTheLateHostIsReady) {
    TwoLive s(with(LateFramePolicy::kHold));
    const FrameNumber late = s.begin(s.commit());
    const Sequence lateSequence = s.sequence;
    s.ready(s.a, late);
    s.run(110ms, {s.a, s.b});
    ASSERT_EQ(s.actions<server_action::FrameReleased>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::FrameReleased>()[0].held, Names{"b"});
    EXPECT_EQ(s.state("b"), HostState::kLate);
    s.forget();
    s.ready(s.a, s.begin(s.commit()));
    EXPECT_TRUE(s.sent<message::Begin>(s.b).empty());
    EXPECT_EQ(s.sent<message::Changes>(s.b).size(), 1u);
    EXPECT_EQ(s.actions<server_action::FrameReleased>()[0].held, Names{"b"});
    s.readyAt(s.b, late, lateSequence);
    EXPECT_TRUE(s.sent<message::Swap>(s.b).empty());  // it keeps its image: frame `late` is over
    s.forget();
    const FrameNumber next = s.begin(s.commit());
    EXPECT_EQ(s.sent<message::Begin>(s.b).size(), 1u);
    EXPECT_EQ(s.state("b"), HostState::kLive);
    s.ready(s.a, next);
    s.ready(s.b, next);
    EXPECT_EQ(s.sent<message::Swap>(s.b).size(), 1u);
}

TEST(ServerFrames, DropWaitsUntilTheLateHostHasCaughtUp) {
    TwoLive s(with(LateFramePolicy::kDrop));
    const FrameNumber late = s.begin(s.commit());
    const Sequence lateSequence = s.sequence;
    s.ready(s.a, late);
    s.run(110ms, {s.a, s.b});
    s.ready(s.a, s.begin(s.commit()));
    s.readyAt(s.b, late, lateSequence);
    EXPECT_EQ(s.state("b"), HostState::kSyncing);
    s.forget();
    s.ready(s.a, s.begin());
    EXPECT_TRUE(s.sent<message::Begin>(s.b).empty());
    s.synced(s.b);
    s.pass(1ms);
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(s.b).size(), 1u);
    const auto entered = s.actions<server_action::HostEntered>();
    ASSERT_EQ(entered.size(), 1u);
    EXPECT_TRUE(entered[0].rejoined);
}

TEST(ServerFrames, DropTakesAHostBackAtOnceWhenNothingChangedMeanwhile) {
    TwoLive s(with(LateFramePolicy::kDrop));
    const FrameNumber late = s.begin();
    s.ready(s.a, late);
    s.run(110ms, {s.a, s.b});
    s.ready(s.a, s.begin());
    s.ready(s.b, late);
    s.forget();
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(s.b).size(), 1u);
}

TEST(ServerFrames, AHungDrawThreadIsClosedAtTheFrameDeadlineThoughItsHeartbeatsGoOn) {
    for (const LateFramePolicy late : {LateFramePolicy::kWait, LateFramePolicy::kHold, LateFramePolicy::kDrop}) {
        TwoLive s(with(late));
        const FrameNumber frame = s.begin();
        s.ready(s.a, frame);
        s.run(980ms, {s.a, s.b});
        EXPECT_TRUE(s.actions<server_action::Fault>().empty());
        s.run(30ms, {s.a, s.b});
        const auto faults = s.actions<server_action::Fault>();
        ASSERT_EQ(faults.size(), 1u);
        EXPECT_EQ(faults[0].kind, FaultKind::kDrawStalled);
        EXPECT_EQ(faults[0].host, "b");
        EXPECT_TRUE(s.closed(s.b));
        ASSERT_EQ(s.sent<message::Refused>(s.b).size(), 1u);
        EXPECT_TRUE(s.sent<message::Refused>(s.b)[0].retry);
        EXPECT_EQ(s.actions<server_action::FrameReleased>().size(), 1u);
    }
}

TEST(ServerFrames, AnnouncedBlobsAreEverywhereOnceAllLiveHostsHoldThem) {
    TwoLive s;
    s.take(s.session.announceBlobs(9, {blobOf("mesh")}, s.now));
    EXPECT_EQ(s.sent<message::BlobNotice>(s.a).size(), 1u);
    s.say(s.a, message::BlobsHeld{9});
    EXPECT_TRUE(s.actions<server_action::BlobsEverywhere>().empty());
    s.say(s.b, message::BlobsHeld{9});
    ASSERT_EQ(s.actions<server_action::BlobsEverywhere>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::BlobsEverywhere>()[0].token, 9u);
}

TEST(ServerFrames, BlobsAreEverywhereAtOnceWithNobodyThere) {
    ServerFixture s;
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    EXPECT_EQ(s.actions<server_action::BlobsEverywhere>().size(), 1u);
}

TEST(ServerFrames, NobodyWaitsForTheBlobsOfALostHost) {
    TwoLive s;
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    s.say(s.a, message::BlobsHeld{1});
    s.drop(s.b);
    EXPECT_EQ(s.actions<server_action::BlobsEverywhere>().size(), 1u);
}

TEST(ServerFrames, AHostThatFetchesTooSlowlyLeavesTheBarrier) {
    ServerSessionConfig config = twoHosts();
    config.blobDeadline = 200ms;
    TwoLive s(config);
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    s.say(s.a, message::BlobsHeld{1});
    s.run(220ms, {s.a, s.b});
    ASSERT_EQ(s.actions<server_action::Fault>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::Fault>()[0].kind, FaultKind::kBlobsLate);
    EXPECT_EQ(s.actions<server_action::BlobsEverywhere>().size(), 1u);
    EXPECT_EQ(s.actions<server_action::SnapshotWanted>().size(), 1u);
    EXPECT_FALSE(s.closed(s.b));
    s.ready(s.a, s.begin(s.commit({blobOf("mesh")})));
    s.snapshot(s.b);
    s.synced(s.b);
    s.forget();
    s.ready(s.a, s.begin());
    EXPECT_TRUE(s.sent<message::Begin>(s.b).empty());  // still owes what it was told of
    s.say(s.b, message::BlobsHeld{1});
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(s.b).size(), 1u);
}

TEST(ServerFrames, AJoiningHostIsNotToldOfBlobsThatNobodyNeedsAnyMore) {
    TwoLive s;
    s.drop(s.b);
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    s.say(s.a, message::BlobsHeld{1});
    s.session.forgetBlobs(1);  // the edit was refused
    const ConnectionId b = s.join("b");
    EXPECT_TRUE(s.sent<message::BlobNotice>(b).empty());
    s.synced(b);
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(b).size(), 1u) << "nothing is owed";
}

TEST(ServerFrames, AJoiningHostLearnsOfBlobsThatNoListHasNamedYet) {
    TwoLive s;
    s.drop(s.b);
    s.take(s.session.announceBlobs(1, {blobOf("mesh")}, s.now));
    s.say(s.a, message::BlobsHeld{1});
    const ConnectionId b = s.join("b");
    EXPECT_EQ(s.sent<message::BlobNotice>(b).size(), 1u);
    s.ready(s.a, s.begin(s.commit({blobOf("mesh")})));
    EXPECT_TRUE(s.sent<message::Begin>(b).empty());  // it would make the barrier wait for bulk data
    s.say(b, message::BlobsHeld{1});
    s.synced(b);
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(b).size(), 1u);
}

TEST(ServerFrames, AListWithBlobsThatASyncingHostWasSentIsWaitedFor) {
    TwoLive s;
    s.drop(s.b);
    const ConnectionId b = s.hello("b");
    s.snapshot(b);
    s.ready(s.a, s.begin(s.commit({blobOf("mesh")})));
    EXPECT_EQ(s.sent<message::Changes>(b).at(0).list->blobs.size(), 1u);
    s.say(b, message::Synced{5_seq, hashAfter(5_seq)});
    s.forget();
    s.ready(s.a, s.begin());
    EXPECT_TRUE(s.sent<message::Begin>(b).empty());
    s.synced(b);
    s.begin();
    EXPECT_EQ(s.sent<message::Begin>(b).size(), 1u);
}

TEST(ServerFrames, AsksHostsInTheBarrierForImages) {
    TwoLive s;
    s.take(s.session.requestImages(4, 0_frame));
    EXPECT_EQ(s.sent<message::ImageRequest>(s.a).size(), 1u);
    ServerFixture fresh;
    const ConnectionId a = fresh.hello("a");
    const ConnectionId bulk = fresh.bulk(a);
    fresh.take(fresh.session.requestImages(4, 0_frame));
    fresh.say(bulk, message::TileImage{.request = 4, .tile = "t"});
    fresh.say(bulk, message::TileImage{.request = 5, .tile = "t"});  // nobody asked for it
    EXPECT_EQ(fresh.actions<server_action::ImageReceived>().size(), 1u);
}

TEST(ServerFrames, TheEndIsToldToEverybodyAndAcceptsNobody) {
    TwoLive s;
    const ConnectionId app = s.follow("viewer");
    const ConnectionId pending = s.open();
    s.forget();
    s.take(s.session.finish("done"));
    for (const ConnectionId c : {s.a, s.b, app, pending}) EXPECT_EQ(s.sent<message::Over>(c).size(), 1u);
    s.forget();
    s.ready(s.a, 0_frame);
    s.run(1s);
    s.drop(s.a);
    EXPECT_TRUE(s.done.empty());
    EXPECT_FALSE(s.session.mayBegin(s.now));
    const ConnectionId late = s.open();
    EXPECT_EQ(s.sent<message::Over>(late).size(), 1u);
    EXPECT_TRUE(s.closed(late));
}

TEST(ServerFramesDeathTest, AListBetweenTwoFramesIsOurOwnBug) {
    ServerFixture s;
    s.begin();
    s.commit();
    EXPECT_DEATH(s.begin(), "nothing is between two frames");
    EXPECT_DEATH(s.begin(s.commit()), "numbered one by one");
}

}  // namespace
}  // namespace tessera
