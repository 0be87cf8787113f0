// One peer's side, with the test speaking for the server and for the replica.
#include "common/session/ClientSession.h"

#include <gtest/gtest.h>

#include "common/session/HeartbeatClock.h"
#include "tests/support/words/Words.h"
#include "tests/unit/session/ClientFixture.h"

namespace tessera {
namespace {

TEST(ClientSession, SaysHelloAndOpensItsBulkConnection) {
    ClientFixture c;
    c.welcomed();
    ASSERT_EQ(c.sent<message::Hello>().size(), 1u);
    EXPECT_EQ(c.sent<message::Hello>()[0].name, "a");
    ASSERT_EQ(c.actions<client_action::Configured>().size(), 1u);
    EXPECT_EQ(c.actions<client_action::Configured>()[0].epoch, 3_epoch);
    EXPECT_EQ(c.actions<client_action::OpenBulk>().size(), 1u);
    c.bulkOpen();
    ASSERT_EQ(c.sent<message::Hello>(ChannelKind::kBulk).size(), 1u);
    EXPECT_EQ(c.sent<message::Hello>(ChannelKind::kBulk)[0].token, (SessionToken{42, 43}));
}

TEST(ClientSession, AppliesSnapshotAndListsInOrderAndIsThenSynced) {
    ClientFixture c;
    c.welcomed();
    c.hear(message::Snapshot{listAt(5_seq)});
    c.hear(message::Changes{listAt(6_seq)});
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>().size(), 1u);  // needs no bulk connection
    EXPECT_TRUE(c.actions<client_action::ApplyChanges>().empty());
    c.take(c.session.applied(5_seq, hashAfter(5_seq)));
    EXPECT_EQ(c.actions<client_action::ApplyChanges>().size(), 1u);
    EXPECT_TRUE(c.sent<message::Synced>().empty());
    c.take(c.session.applied(6_seq, hashAfter(6_seq)));
    EXPECT_EQ(c.sent<message::Synced>(), (std::vector{message::Synced{6_seq, hashAfter(6_seq)}}));
}

TEST(ClientSession, AReplicaThatDiffersStartsOver) {
    ClientFixture c;
    c.welcomed();
    c.hear(message::Snapshot{listAt(5_seq)});
    c.take(c.session.applied(5_seq, 666_hash));
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>()[0].retry);
    EXPECT_TRUE(c.sent<message::Synced>().empty());
}

TEST(ClientSession, AListThatCannotBeAppliedStartsOver) {
    ClientFixture c;
    c.welcomed();
    c.hear(message::Snapshot{listAt(5_seq)});
    c.take(c.session.applyFailed("no such node"));
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>()[0].retry);
}

TEST(ClientSession, DrawsShowsAndSaysSo) {
    ClientFixture c;
    c.inStep();
    c.hear(message::Begin{.frame = 7_frame, .list = listAt(5_seq)});
    ASSERT_EQ(c.actions<client_action::Draw>().size(), 1u);
    EXPECT_TRUE(c.sent<message::Ready>().empty());
    c.take(c.session.drawn(7_frame, 99_hash, nullptr));
    ASSERT_EQ(c.sent<message::Ready>().size(), 1u);
    EXPECT_EQ(c.sent<message::Ready>()[0].stateHash, 99_hash);
    EXPECT_TRUE(c.actions<client_action::Show>().empty());
    c.hear(message::Swap{7_frame});
    ASSERT_EQ(c.actions<client_action::Show>().size(), 1u);
    c.take(c.session.shown(7_frame, c.now));
    EXPECT_EQ(c.sent<message::Shown>().size(), 1u);
}

TEST(ClientSession, DrawsNoFrameBeforeTheLastOneIsShown) {
    ClientFixture c;
    c.inStep();
    c.hear(message::Begin{.frame = 0_frame});
    c.take(c.session.drawn(0_frame, 0_hash, nullptr));
    c.hear(message::Swap{0_frame});
    c.hear(message::Begin{.frame = 1_frame});
    EXPECT_EQ(c.actions<client_action::Draw>().size(), 1u);
    c.take(c.session.shown(0_frame, c.now));
    EXPECT_EQ(c.actions<client_action::Draw>().size(), 2u);
}

TEST(ClientSession, ListsThatComeWhileItDrawsWaitTheirTurn) {
    ClientFixture c;
    c.inStep();
    c.hear(message::Begin{.frame = 0_frame});
    c.hear(message::Changes{listAt(6_seq)});
    c.hear(message::Begin{.frame = 2_frame});
    EXPECT_TRUE(c.actions<client_action::ApplyChanges>().empty());
    c.take(c.session.drawn(0_frame, 0_hash, nullptr));
    EXPECT_EQ(c.actions<client_action::ApplyChanges>().size(), 1u);
    EXPECT_EQ(c.actions<client_action::Draw>().size(), 1u);
    c.take(c.session.applied(6_seq, hashAfter(6_seq)));
    EXPECT_EQ(c.actions<client_action::Draw>().size(), 2u);
}

TEST(ClientSession, ASwapOfAFrameItDidNotDrawIsNonsense) {
    ClientFixture c;
    c.inStep();
    c.hear(message::Begin{.frame = 3_frame});
    c.take(c.session.drawn(3_frame, 0_hash, nullptr));
    c.hear(message::Swap{2_frame});
    EXPECT_TRUE(c.actions<client_action::Show>().empty());
    EXPECT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
}

TEST(ClientSession, FetchesBlobsInAWindowBeforeItApplies) {
    ClientFixture c;
    const Blob large(content(450, 1)), small(content(10, 2));
    c.welcomed();
    c.hear(message::Snapshot{listAt(5_seq, {infoOf(large), infoOf(small)})});
    EXPECT_TRUE(c.actions<client_action::ApplySnapshot>().empty());
    c.bulkOpen();
    EXPECT_EQ(c.sent<message::BlobRequest>(ChannelKind::kBulk).size(), 2u);  // the window
    c.answerChunks({large, small});
    EXPECT_EQ(c.sent<message::BlobRequest>(ChannelKind::kBulk).size(), 6u);
    ASSERT_EQ(c.actions<client_action::StoreBlob>().size(), 2u);
    EXPECT_EQ(c.actions<client_action::StoreBlob>()[0].blob, large);
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>().size(), 1u);
}

TEST(ClientSession, DoesNotFetchWhatItHolds) {
    ClientFixture c;
    const Blob blob(content(450, 1));
    c.session.holdBlob(blob.id());
    c.welcomed();
    c.bulkOpen();
    c.hear(message::Snapshot{listAt(5_seq, {infoOf(blob)})});
    EXPECT_TRUE(c.sent<message::BlobRequest>(ChannelKind::kBulk).empty());
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>().size(), 1u);
}

TEST(ClientSession, GoesOnWithABlobWhereABrokenBulkConnectionLeftIt) {
    ClientFixture c;
    const Blob blob(content(450, 1));
    c.welcomed();
    c.bulkOpen();
    c.hear(message::Snapshot{listAt(5_seq, {infoOf(blob)})});
    const auto first = c.sent<message::BlobRequest>(ChannelKind::kBulk);
    const ByteSpan head = blob.bytes().subspan(0, 100);
    c.hear(message::BlobChunk{blob.id(), 0, 450, share(Bytes(head.begin(), head.end()))}, ChannelKind::kBulk);
    c.take(c.session.channelClosed(ChannelKind::kBulk, c.now));
    EXPECT_EQ(c.actions<client_action::OpenBulk>().size(), 1u);
    c.now += 200ms;
    c.take(c.session.advance(c.now));
    ASSERT_EQ(c.actions<client_action::OpenBulk>().size(), 2u);
    c.done.clear();
    c.bulkOpen();
    ASSERT_FALSE(c.sent<message::BlobRequest>(ChannelKind::kBulk).empty());
    EXPECT_EQ(c.sent<message::BlobRequest>(ChannelKind::kBulk)[0].offset, 100u);
    c.answerChunks({blob});
    ASSERT_EQ(c.actions<client_action::StoreBlob>().size(), 1u);
}

TEST(ClientSession, ADeadBulkConnectionEndsTheConnectionThoughTheOtherOneLives) {
    ClientFixture c;
    const Blob blob(content(450, 1));
    c.welcomed();
    c.bulkOpen();
    const auto live = [&](Duration time) {
        for (const TimePoint end = c.now + time; c.now < end;) {
            c.now += 50ms;
            c.hear(message::Heartbeat{.sentAtNs = 1});
            c.take(c.session.advance(c.now));
        }
    };
    live(20s);  // nothing is wanted of it
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    c.hear(message::Snapshot{listAt(5_seq, {infoOf(blob)})});
    live(14'900ms);
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    live(200ms);
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>()[0].retry);
}

TEST(ClientSession, DamagedMissingOrUnaskedChunksEndTheConnection) {
    const Blob blob(content(80, 1));
    const ByteSlice right = blob.slice();
    const SharedBytes wrong = share(content(80, 2));
    const std::vector<message::BlobChunk> bad{{blob.id(), 0, 80, wrong}, {blob.id(), 0, 0, nullptr},
                                              {blob.id(), 0, 81, right}, {blob.id(), 0, 80, share(content(79, 1))},
                                              {blob.id(), 1, 80, right}, {blobOf("other").id, 0, 80, right}};
    for (const message::BlobChunk& chunk : bad) {
        ClientFixture c;
        c.welcomed();
        c.bulkOpen();
        c.hear(message::Snapshot{listAt(5_seq, {infoOf(blob)})});
        c.hear(chunk, ChannelKind::kBulk);
        ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
        EXPECT_TRUE(c.actions<client_action::Disconnect>()[0].retry);
        EXPECT_TRUE(c.actions<client_action::StoreBlob>().empty());
        EXPECT_TRUE(c.actions<client_action::ApplySnapshot>().empty());
    }
}

TEST(ClientSession, ABlobAboveTheLimitIsRefusedBeforeAnyOfItIsFetched) {
    ClientSessionConfig config = ClientFixture::named();
    config.maxBlobBytes = 1000;
    ClientFixture c(config);
    c.welcomed();
    c.bulkOpen();
    c.hear(message::Snapshot{listAt(5_seq, {{blobOf("x").id, 1001}})});
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_FALSE(c.actions<client_action::Disconnect>()[0].retry);
    EXPECT_EQ(c.actions<client_action::Disconnect>()[0].code, ErrorCode::kLimit);
    EXPECT_TRUE(c.sent<message::BlobRequest>(ChannelKind::kBulk).empty());
}

TEST(ClientSession, FetchesAnnouncedBlobsWhileItDraws) {
    ClientFixture c;
    const Blob blob(content(450, 1));
    c.inStep();
    c.bulkOpen();
    c.hear(message::Begin{.frame = 0_frame});
    c.hear(message::BlobNotice{9, {infoOf(blob)}});
    EXPECT_TRUE(c.sent<message::BlobsHeld>().empty());
    c.answerChunks({blob});
    EXPECT_EQ(c.sent<message::BlobsHeld>(), std::vector{message::BlobsHeld{9}});
    c.hear(message::BlobNotice{10, {infoOf(blob)}});
    EXPECT_EQ(c.sent<message::BlobsHeld>().size(), 2u);
}

/// The server gives up what it has announced: an answer without bytes to each chunk that was asked for.
void withdraw(ClientFixture& c, const Blob& blob, std::uint64_t offset) {
    c.hear(message::BlobChunk{blob.id(), offset, 0, {}}, ChannelKind::kBulk);
}

TEST(ClientSession, WhatWasAnnouncedForACancelledLoadCostsNothing) {
    ClientFixture c;
    c.inStep();
    c.bulkOpen();
    const Blob cancelled(content(450, 1)), later(content(150, 2));
    c.hear(message::BlobNotice{7, {infoOf(cancelled)}});
    c.hear(message::BlobNotice{8, {infoOf(later)}});
    withdraw(c, cancelled, 0);
    withdraw(c, cancelled, 100);
    c.answered = {{cancelled.id(), 0}, {cancelled.id(), 100}};
    c.answerChunks({later});
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    ASSERT_EQ(c.sent<message::BlobsHeld>().size(), 1u);
    EXPECT_EQ(c.sent<message::BlobsHeld>()[0].token, 8u);
    // The same file once more.
    c.done.clear();
    c.answered.clear();
    c.hear(message::BlobNotice{9, {infoOf(cancelled)}});
    c.answerChunks({cancelled});
    ASSERT_EQ(c.sent<message::BlobsHeld>().size(), 1u);
    EXPECT_EQ(c.sent<message::BlobsHeld>()[0].token, 9u);
    EXPECT_EQ(c.actions<client_action::StoreBlob>().size(), 1u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
}

/// The next load of the same file may be announced while the answer to a chunk for the cancelled one is on its way.
TEST(ClientSession, WhatIsAnnouncedAnewIsAskedForAnew) {
    ClientFixture c;
    c.inStep();
    c.bulkOpen();
    const Blob blob(content(450, 1));
    c.hear(message::BlobNotice{7, {infoOf(blob)}});
    c.hear(message::BlobNotice{9, {infoOf(blob)}});
    c.done.clear();
    withdraw(c, blob, 0);
    withdraw(c, blob, 100);
    c.answerChunks({blob});
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    const auto held = c.sent<message::BlobsHeld>();
    EXPECT_TRUE(std::ranges::any_of(held, [](const auto& one) { return one.token == 9; }));
    // And it may come between the answers.
    const Blob other(content(450, 2));
    c.hear(message::BlobNotice{11, {infoOf(other)}});
    withdraw(c, other, 0);
    c.done.clear();
    c.answered.clear();
    c.hear(message::BlobNotice{12, {infoOf(other)}});
    withdraw(c, other, 100);
    c.answerChunks({other});
    ASSERT_EQ(c.sent<message::BlobsHeld>().size(), 1u);
    EXPECT_EQ(c.sent<message::BlobsHeld>()[0].token, 12u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
}

TEST(ClientSession, WhatALeavingLoadWantedIsForgottenWithTheBulkConnection) {
    ClientFixture c;
    c.inStep();
    c.bulkOpen();
    const Blob gone(content(450, 1)), blob(content(250, 2));
    c.hear(message::BlobNotice{7, {infoOf(gone)}});
    withdraw(c, gone, 0);
    c.take(c.session.channelClosed(ChannelKind::kBulk, c.now));
    c.hear(message::BlobNotice{8, {infoOf(blob)}});
    c.done.clear();
    c.bulkOpen();
    c.answerChunks({gone, blob});
    EXPECT_EQ(c.actions<client_action::StoreBlob>().size(), 1u);
    EXPECT_EQ(c.sent<message::BlobsHeld>().size(), 1u);
}

TEST(ClientSession, AnswersHashQueriesBetweenItsOtherWork) {
    ClientFixture c;
    c.inStep();
    c.hear(message::Begin{.frame = 0_frame});
    c.hear(message::HashQuery{});
    EXPECT_TRUE(c.actions<client_action::DescribeState>().empty());
    c.take(c.session.drawn(0_frame, 0_hash, nullptr));
    ASSERT_EQ(c.actions<client_action::DescribeState>().size(), 1u);
    c.hear(message::Snapshot{listAt(9_seq)});
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>().size(), 1u);  // the first one only: it is being looked at
    c.take(c.session.hashes({.sequence = 5_seq}));
    EXPECT_EQ(c.sent<message::HashAnswer>().size(), 1u);
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>().size(), 2u);
}

TEST(ClientSession, GivesUpRatherThanQueueWithoutEnd) {
    ClientSessionConfig config = ClientFixture::named();
    config.maxQueuedMessages = 4;
    ClientFixture c(config);
    c.welcomed();
    c.hear(message::Snapshot{listAt(5_seq, {blobOf("never comes")})});
    for (std::uint64_t i = 6; i < 9; ++i) c.hear(message::Changes{listAt(Sequence(i))});
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    c.hear(message::Changes{listAt(9_seq)});
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>()[0].retry);
}

TEST(ClientSession, AWholeSceneThatWaitsForItsBlobsIsNoBacklogHoweverLargeItIs) {
    ClientSessionConfig config = ClientFixture::named();
    config.maxQueuedBytes = 100;
    ClientFixture c(config);
    c.welcomed();
    c.hear(message::Snapshot{listAt(5_seq, {blobOf("never comes")}, textBytes(std::string(5000, 'x')))});
    c.hear(message::Changes{listAt(6_seq, {}, textBytes(std::string(60, 'x')))});
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    c.hear(message::Changes{listAt(7_seq, {}, textBytes(std::string(60, 'x')))});
    EXPECT_EQ(c.actions<client_action::Disconnect>().size(), 1u) << "what comes behind it is";
}

TEST(ClientSession, ARefusalSaysWhetherToTryAgain) {
    ClientFixture c;
    c.connect();
    c.hear(message::Refused{ErrorCode::kNotFound, "unknown host 'a'", false});
    const auto disconnect = c.actions<client_action::Disconnect>();
    ASSERT_EQ(disconnect.size(), 1u);
    EXPECT_FALSE(disconnect[0].retry);
    EXPECT_EQ(disconnect[0].code, ErrorCode::kNotFound);
    EXPECT_EQ(disconnect[0].reason, "unknown host 'a'");
}

TEST(ClientSession, FinishesWhenTheServerSaysSo) {
    ClientFixture c;
    c.inStep();
    c.hear(message::Begin{.frame = 0_frame});
    c.hear(message::Over{"done"});
    EXPECT_EQ(c.actions<client_action::Finish>().size(), 1u);
    c.done.clear();
    c.take(c.session.drawn(0_frame, 0_hash, nullptr));  // the draw thread did not know yet
    c.take(c.session.channelClosed(ChannelKind::kControl, c.now));
    c.take(c.session.advance(c.now + 1h));
    EXPECT_TRUE(c.done.empty());
    EXPECT_EQ(c.session.nextDeadline(), TimePoint::max());
}

TEST(ClientSession, ASilentServerIsABrokenConnection) {
    ClientFixture c;
    c.inStep();
    for (int i = 0; i < 499; ++i) c.take(c.session.advance(c.now += 10ms));
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    EXPECT_EQ(c.sent<message::Heartbeat>().size(), 100u);  // the first at once
    c.take(c.session.advance(c.now += 10ms));
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_TRUE(c.actions<client_action::Disconnect>()[0].retry);
}

TEST(ClientSession, AfterAStandstillOfItsOwnTheServerGetsAMoment) {
    ClientFixture c;
    c.inStep();
    c.take(c.session.advance(c.now));
    c.now += 20s;
    c.take(c.session.advance(c.now));
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
    c.hear(message::Heartbeat{.sentAtNs = 1});
    c.take(c.session.advance(c.now += 60ms));
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
}

TEST(ClientSession, MessagesThatAServerNeverSendsEndTheConnection) {
    for (const Message& message : {Message(message::Hello{}), Message(message::Ready{}), Message(message::Welcome{}),
                                   Message(message::Reply{}), Message(message::BlobChunk{})}) {
        ClientFixture c;
        c.inStep();
        c.hear(message);
        EXPECT_EQ(c.actions<client_action::Disconnect>().size(), 1u) << nameOf(message);
    }
}

TEST(ClientSession, EstimatesTheServersClockFromTheShortestRoundTrip) {
    ClientFixture c;
    c.inStep();
    constexpr std::int64_t kAhead = 3'000'000'000;
    const auto exchange = [&](Duration there, Duration back) {
        const std::int64_t sentAt = toNs(c.now);
        c.now += there;
        const std::int64_t server = toNs(c.now) + kAhead;
        c.now += back;
        c.hear(message::Heartbeat{.sentAtNs = server, .echoNs = sentAt, .heldNs = 0});
    };
    exchange(20ms, 2ms);  // lopsided: off by 9 ms
    EXPECT_NE(c.session.clockOffsetNs(), kAhead);
    exchange(1ms, 1ms);
    EXPECT_EQ(c.session.clockOffsetNs(), kAhead);
    exchange(2ms, 30ms);
    EXPECT_EQ(c.session.clockOffsetNs(), kAhead);
    c.hear(message::Begin{.frame = 0_frame});
    c.take(c.session.drawn(0_frame, 0_hash, nullptr));
    c.hear(message::Swap{0_frame});
    c.take(c.session.shown(0_frame, c.now));
    EXPECT_EQ(c.sent<message::Shown>().at(0).shownAtNs, toNs(c.now) + kAhead);
}

TEST(ClientSession, ImagesWaitForTheBulkConnection) {
    ClientFixture c;
    c.inStep();
    c.hear(message::ImageRequest{1, 0_frame});
    EXPECT_EQ(c.actions<client_action::SendImages>().size(), 1u);
    c.take(c.session.image({.request = 1, .tile = "t"}));
    EXPECT_TRUE(c.sent<message::TileImage>(ChannelKind::kBulk).empty());
    c.bulkOpen();
    EXPECT_EQ(c.sent<message::TileImage>(ChannelKind::kBulk).size(), 1u);
}

ClientSessionConfig application(bool wantBlobs) {
    ClientSessionConfig config = ClientFixture::named();
    config.role = PeerRole::kApplication;
    config.wantBlobs = wantBlobs;
    return config;
}

TEST(ClientSession, AnApplicationMayFollowWithoutBulkData) {
    ClientFixture c(application(false));
    c.welcomed();
    EXPECT_TRUE(c.actions<client_action::OpenBulk>().empty());
    c.hear(message::Snapshot{listAt(5_seq, {blobOf("x")})});
    c.take(c.session.applied(5_seq, hashAfter(5_seq)));
    c.hear(message::Changes{listAt(6_seq, {blobOf("y")})});
    EXPECT_EQ(c.actions<client_action::ApplyChanges>().size(), 1u);
    EXPECT_EQ(c.sent<message::Synced>().size(), 1u);  // the server need not keep its snapshot any longer
}

TEST(ClientSession, BytesOfAMessageThatIsStillComingAreASignOfLife) {
    ClientFixture c;
    c.inStep();
    for (int i = 0; i < 100; ++i) {
        c.now += 100ms;
        c.session.heard(ChannelKind::kControl, c.now);
        c.take(c.session.advance(c.now));
    }
    EXPECT_TRUE(c.actions<client_action::Disconnect>().empty());
}

TEST(ClientSession, AnApplicationThatOnlyAsksSaysSoAndTakesNoScene) {
    ClientSessionConfig config = application(false);
    config.follows = false;
    ClientFixture c(config);
    c.welcomed();
    ASSERT_EQ(c.sent<message::Hello>().size(), 1u);
    EXPECT_FALSE(c.sent<message::Hello>()[0].follows);
    c.hear(message::Notice{});
    EXPECT_EQ(c.actions<client_action::NoticeReceived>().size(), 1u);
    c.hear(message::Snapshot{listAt(5_seq)});
    EXPECT_TRUE(c.actions<client_action::ApplySnapshot>().empty());
    ASSERT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
    EXPECT_WORDS(c.actions<client_action::Disconnect>()[0].reason);
}

TEST(ClientSession, AnApplicationThatWantsBlobsFetchesThemBeforeItApplies) {
    ClientFixture c(application(true));
    const Blob blob(content(250, 3));
    c.welcomed();
    c.bulkOpen();
    c.hear(message::Snapshot{listAt(5_seq)});
    c.take(c.session.applied(5_seq, hashAfter(5_seq)));
    c.hear(message::Changes{listAt(6_seq, {infoOf(blob)})});
    EXPECT_TRUE(c.actions<client_action::ApplyChanges>().empty());
    c.answerChunks({blob});
    EXPECT_EQ(c.actions<client_action::ApplyChanges>().size(), 1u);
}

TEST(ClientSession, RequestsWaitForTheWelcomeWithinABound) {
    ClientSessionConfig config = application(false);
    config.maxWaitingRequests = 2;
    ClientFixture c(config);
    c.connect();
    for (std::uint64_t id = 1; id <= 3; ++id) c.take(c.session.request({id, nullptr}));
    EXPECT_TRUE(c.sent<message::Request>().empty());
    ASSERT_EQ(c.actions<client_action::ReplyReceived>().size(), 1u);
    EXPECT_EQ(c.actions<client_action::ReplyReceived>()[0].reply.id, 3u);
    EXPECT_EQ(c.actions<client_action::ReplyReceived>()[0].reply.code, ErrorCode::kLimit);
    c.hear(message::Welcome{.epoch = 3_epoch});
    EXPECT_EQ(c.sent<message::Request>().size(), 2u);
    c.hear(message::Reply{.id = 1});
    c.hear(message::Notice{});
    EXPECT_EQ(c.actions<client_action::NoticeReceived>().size(), 1u);
}

TEST(ClientSession, WhatIsUploadedBeforeTheWelcomeGoesOutBeforeTheRequestThatNeedsIt) {
    ClientFixture c(application(false));
    c.connect();
    for (std::uint64_t id = 1; id <= 2; ++id) {
        const Blob blob(content(100 * id, 3));
        c.take(c.session.upload({.blobs = {infoOf(blob)}, .bytes = blob.slice()}));
        c.take(c.session.request({id, nullptr}));
    }
    EXPECT_TRUE(c.sent<message::Upload>().empty() && c.sent<message::Request>().empty());
    c.hear(message::Welcome{.epoch = 3_epoch});
    std::vector<std::uint64_t> order;  // of uploads their bytes
    for (const client_action::Send& send : c.actions<client_action::Send>()) {
        if (const auto* upload = std::get_if<message::Upload>(&send.message)) order.push_back(upload->bytes.size());
        if (const auto* request = std::get_if<message::Request>(&send.message)) order.push_back(request->id);
    }
    EXPECT_EQ(order, (std::vector<std::uint64_t>{100, 1, 200, 2}));
}

}  // namespace
}  // namespace tessera
