/// What the server's session is made of, each part by itself.
#include <gtest/gtest.h>

#include "common/session/Admission.h"
#include "common/session/BlobAnnouncements.h"
#include "common/session/Grace.h"
#include "common/session/ImageCalls.h"
#include "common/session/ListFollowers.h"
#include "common/session/MachineBoards.h"
#include "tests/support/words/Words.h"
#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

constexpr TimePoint kStart{10s};

SyncPolicy quickPolicy() {
    SyncPolicy policy;
    policy.heartbeat = 50ms;
    policy.lostAfter = 250ms;
    return policy;
}

TEST(Grace, LastsAHeartbeatAfterAStandstillAndJudgesNothingMeanwhile) {
    Grace grace(quickPolicy());
    grace.look(kStart);
    EXPECT_FALSE(grace.lasts(kStart));
    EXPECT_EQ(grace.known(kStart), kStart);
    grace.look(kStart + 125ms);  // half of lostAfter is no standstill
    EXPECT_FALSE(grace.lasts(kStart + 125ms));
    const TimePoint back = kStart + 300ms;
    grace.look(back);
    EXPECT_TRUE(grace.lasts(back));
    EXPECT_EQ(grace.until(), back + 50ms);
    EXPECT_EQ(grace.known(back + 10ms), kStart + 125ms) << "what came meanwhile may lie unread";
    grace.look(back + 50ms);
    EXPECT_FALSE(grace.lasts(back + 50ms));
    EXPECT_EQ(grace.known(back + 50ms), back + 50ms);
}

TEST(Grace, ACallerThatIsAlwaysSlowGetsThreeMomentsInARow) {
    Grace grace(quickPolicy());
    TimePoint now = kStart;
    grace.look(now);
    std::string moments;
    for (int k = 0; k < 8; ++k) {
        grace.look(now += 200ms);
        moments += grace.lasts(now) ? 'g' : 'j';
    }
    EXPECT_EQ(moments, "gggjgggj") << "then silence is judged with what is known";
    for (int k = 0; k < 8; ++k) {
        grace.look(now += 200ms);
        EXPECT_TRUE(grace.lasts(now));
        grace.look(now + 60ms);  // between two standstills the moment was over
    }
}

TEST(Grace, TellsHowLongTheClockWasNotLookedAt) {
    Grace grace(quickPolicy());
    EXPECT_EQ(grace.stoodStill(kStart), Duration::zero());
    EXPECT_EQ(grace.stoodStill(kStart + 125ms), Duration::zero());
    EXPECT_EQ(grace.stoodStill(kStart + 425ms), Duration(300ms));
}

const std::vector<BlobInfo> kOneBlob{blobOf("one")};

TEST(BlobAnnouncements, AreEverywhereOnceWhenAllWhoAreAwaitedHoldThem) {
    BlobAnnouncements known(8, 1s);
    EXPECT_TRUE(known.announce(1, kOneBlob, {"a", "b", "c"}, {"a", "b"}, kStart).empty());
    EXPECT_TRUE(known.owes("c")) << "told, but not waited for";
    known.held("a", 1);
    EXPECT_TRUE(known.everywhere().empty());
    EXPECT_EQ(known.late(kStart + 1s), std::set<std::string>{"b"});
    EXPECT_EQ(known.nextDeadline(), kStart + 1s);
    known.notAwaited("b");  // it left
    EXPECT_EQ(known.everywhere(), std::vector<std::uint64_t>{1});
    EXPECT_TRUE(known.everywhere().empty()) << "said once";
    EXPECT_EQ(known.nextDeadline(), TimePoint::max());
    EXPECT_TRUE(known.owes("b"));
    known.comesAnew("b");
    EXPECT_FALSE(known.owes("b"));
    EXPECT_EQ(known.owedNow("b").size(), 1u);
    EXPECT_TRUE(known.owedNow("b").empty()) << "it owes it already";
}

TEST(BlobAnnouncements, GoOnceAListHasNamedThemOrThereAreTooMany) {
    BlobAnnouncements known(2, 1s);
    EXPECT_EQ(known.announce(1, kOneBlob, {}, {}, kStart), std::vector<std::uint64_t>{1});
    EXPECT_TRUE(known.announce(2, {blobOf("two")}, {"a"}, {"a"}, kStart).empty());
    known.named({blobOf("two")});
    EXPECT_EQ(known.owedNow("b").size(), 2u) << "what is not everywhere stays";
    known.named(kOneBlob);
    EXPECT_EQ(known.owedNow("c").size(), 1u);
    (void)known.announce(3, kOneBlob, {}, {}, kStart);
    (void)known.announce(4, kOneBlob, {}, {}, kStart);
    const std::vector<message::BlobNotice> left = known.owedNow("d");
    ASSERT_EQ(left.size(), 2u);
    EXPECT_EQ(left[0].token, 2u) << "somebody waits for it";
    EXPECT_EQ(left[1].token, 4u);
}

TEST(Admission, ANameThatIsHeldIsRefusedForGoodOnceItsHolderIsKnownToSpeak) {
    const ServerSessionConfig config = twoHosts();
    Admission admission(config);
    const ConnectionId holder{1};
    const Admission::Refusal first = admission.taken("a", holder, kStart, kStart);
    EXPECT_TRUE(first.retry) << "the holder may have died without a word";
    EXPECT_TRUE(admission.taken("a", holder, kStart + 1ms, kStart + 399ms).retry);
    const Admission::Refusal last = admission.taken("a", holder, kStart + 1ms, kStart + 400ms);
    EXPECT_FALSE(last.retry);
    EXPECT_WORDS(last.reason);
    EXPECT_TRUE(admission.taken("a", holder, kStart + 400ms, kStart + 401ms).retry) << "the next one begins anew";
}

TEST(Admission, TheEpochRisesAboveWhatAHostHasSeenUntilOneHasEntered) {
    ServerSessionConfig config = twoHosts();
    config.epoch = 5_epoch;
    config.furthestSeen = 100_epoch;
    Admission admission(config);
    EXPECT_FALSE(admission.epochOf("a", 5_epoch, false).raisedFrom);
    EXPECT_FALSE(admission.epochOf("a", 101_epoch, false).refused->retry);
    EXPECT_EQ(admission.epoch(), 5_epoch);
    EXPECT_EQ(admission.epochOf("a", 9_epoch, false).raisedFrom, 5_epoch);
    EXPECT_EQ(admission.epoch(), 10_epoch);
    const Admission::EpochVerdict late = admission.epochOf("b", 11_epoch, true);
    ASSERT_TRUE(late.refused);
    EXPECT_TRUE(late.refused->retry);
    EXPECT_EQ(admission.epoch(), 10_epoch);
}

TEST(MachineBoards, HostsOfAMachineAreToldOfEachChangeOnce) {
    MachineBoards boards({"a", "b", "c"});
    EXPECT_TRUE(boards.arrives("a", "m", "board-a").empty()) << "it is alone";
    EXPECT_TRUE(boards.arrives("c", "other", "board-c").empty());
    const MachineBoards::News both = boards.arrives("b", "m", "board-b");
    ASSERT_EQ(both.size(), 2u);
    EXPECT_EQ(both[0].first, "a");
    EXPECT_EQ(both[0].second.boards, "b board-b\n");
    EXPECT_EQ(both[1].second.boards, "a board-a\n");
    const MachineBoards::News alone = boards.leaves("b");
    ASSERT_EQ(alone.size(), 1u);
    EXPECT_EQ(alone[0].second.boards, "");
    EXPECT_TRUE(boards.arrives("b", "m", "").empty()) << "it has nothing to share";
    boards.startOver();
    EXPECT_TRUE(boards.leaves("a").empty());
}

TEST(ListFollowers, WhoDoesNotReadGetsTheListsSinceOnceItHas) {
    ServerSessionConfig config = twoHosts();
    config.maxUnsentBytes = 100;
    std::size_t unsent = 0;
    ListFollowers followers(config, [&](ConnectionId) { return unsent; });
    const ConnectionId reader{1};
    ServerActions out;
    followers.look(kStart);
    followers.record(listAt(5_seq));
    followers.ask(reader, "reader", out);
    ASSERT_TRUE(followers.awaitsSnapshot(reader));
    message::Snapshot snapshot{listAt(5_seq)};
    followers.given(reader, snapshot, {}, kStart);
    EXPECT_TRUE(followers.sendSince(reader, out).empty());
    out.clear();

    const auto commit = [&](std::uint64_t sequence, std::vector<BlobInfo> blobs = {}) {
        const CommittedListPtr list = listAt(Sequence(sequence), std::move(blobs), textBytes("list"));
        const std::vector<ListFollowers::Fetching> fetching = followers.send(list, out);
        followers.record(list);
        return fetching.size();
    };
    EXPECT_EQ(commit(6), 0u);
    EXPECT_EQ(out.size(), 1u);
    unsent = 101;
    EXPECT_EQ(commit(7, kOneBlob), 0u);
    EXPECT_EQ(commit(8), 0u);
    EXPECT_EQ(out.size(), 1u) << "it is behind";
    EXPECT_EQ(followers.sentThrough(reader), 6_seq);
    unsent = 51;
    EXPECT_TRUE(followers.catchUp(out).empty());
    unsent = 50;
    const std::vector<ListFollowers::Fetching> fetching = followers.catchUp(out);
    ASSERT_EQ(fetching.size(), 1u) << "one of them names blobs";
    EXPECT_EQ(fetching[0].sequence, 7_seq);
    EXPECT_EQ(out.size(), 3u);
    EXPECT_EQ(followers.sentThrough(reader), 8_seq);
}

TEST(ImageCalls, TheNewestAreKnown) {
    ImageCalls calls;
    for (std::uint64_t k = 0; k <= ImageCalls::kRemembered; ++k) calls.made(k);
    EXPECT_FALSE(calls.knows(0));
    EXPECT_TRUE(calls.knows(1));
    EXPECT_TRUE(calls.knows(ImageCalls::kRemembered));
}

}  // namespace
}  // namespace tessera
