#include "common/session/SwapBarrier.h"

#include <gtest/gtest.h>

#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Names = std::vector<std::string>;

TimePoint at(Duration t) {
    return TimePoint(1s + t);
}

SyncPolicy policy(LateFramePolicy late) {
    SyncPolicy p;
    p.lateFrame = late;
    p.frameDeadline = 1'000ms;
    p.firstFrameDeadline = 1'000ms;
    p.lateAfter = 100ms;
    return p;
}

SwapBarrier barrierOf(LateFramePolicy late, const Names& hosts) {
    SwapBarrier barrier(policy(late));
    for (const std::string& host : hosts) barrier.enter(host);
    return barrier;
}

/// One frame that everybody draws in time, and shows at once.
void wholeFrame(SwapBarrier& barrier, Duration begun, Duration drawing) {
    const FrameNumber frame = barrier.nextFrame();
    for (const std::string& host : barrier.begin(frame, at(begun)))
        ASSERT_TRUE(barrier.ready(host, frame, at(begun + drawing)));
    const SwapBarrier::Outcome outcome = barrier.poll(at(begun + drawing));
    ASSERT_TRUE(outcome.released);
    for (const std::string& host : outcome.show) barrier.shown(host, frame, at(begun + drawing));
}
/// One that everybody has drawn at `ready`, and nobody says to show.
void releasedFrame(SwapBarrier& barrier, Duration ready) {
    const FrameNumber frame = barrier.nextFrame();
    for (const std::string& host : barrier.begin(frame, at(ready))) ASSERT_TRUE(barrier.ready(host, frame, at(ready)));
    ASSERT_TRUE(barrier.poll(at(ready)).released);
    barrier.told(at(ready));
}

TEST(SwapBarrier, ReleasesAFrameOnceEverybodyHasDrawnIt) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    EXPECT_EQ(barrier.begin(0_frame, at(0ms)), (Names{"a", "b"}));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    EXPECT_FALSE(barrier.poll(at(10ms)).released);
    EXPECT_EQ(barrier.waitingFor(), Names{"b"});
    ASSERT_TRUE(barrier.ready("b", 0_frame, at(30ms)));
    const SwapBarrier::Outcome outcome = barrier.poll(at(30ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.frame, 0_frame);
    EXPECT_EQ(outcome.show, (Names{"a", "b"}));
    EXPECT_EQ(outcome.barrierTime, 20ms);
    EXPECT_EQ(outcome.frameTime, 30ms);
    EXPECT_EQ(outcome.lastHost, "b");
}

TEST(SwapBarrier, SaysHowLongAllOthersWaitedForTheLast) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b", "c"});
    (void)barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("b", 0_frame, at(10ms)));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(25ms)));
    ASSERT_TRUE(barrier.ready("c", 0_frame, at(40ms)));
    SwapBarrier::Outcome outcome = barrier.poll(at(41ms));
    EXPECT_EQ(outcome.lastHost, "c");
    EXPECT_TRUE(outcome.wait.drew);
    EXPECT_EQ(outcome.wait.before, "a");
    EXPECT_EQ(outcome.wait.took, 40ms);
    EXPECT_EQ(outcome.wait.beforeTook, 25ms);
    EXPECT_EQ(outcome.wait.alone, 15ms);

    (void)barrier.begin(1_frame, at(50ms));
    ASSERT_TRUE(barrier.ready("a", 1_frame, at(60ms)));
    ASSERT_TRUE(barrier.ready("b", 1_frame, at(62ms)));
    barrier.leave("c");
    outcome = barrier.poll(at(70ms));
    EXPECT_EQ(outcome.lastHost, "c");
    EXPECT_FALSE(outcome.wait.drew) << "it is gone";
    EXPECT_EQ(outcome.wait.before, "b");
    EXPECT_EQ(outcome.wait.alone, 8ms);

    barrier.leave("b");
    (void)barrier.begin(2_frame, at(80ms));
    ASSERT_TRUE(barrier.ready("a", 2_frame, at(90ms)));
    outcome = barrier.poll(at(90ms));
    EXPECT_TRUE(outcome.wait.before.empty()) << "nobody waits for the only one";
    EXPECT_EQ(outcome.wait.alone, 0ms);
}

TEST(SwapBarrier, ReleasesEachFrameOnce) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    wholeFrame(barrier, 0ms, 5ms);
    EXPECT_FALSE(barrier.poll(at(6ms)).released);
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(7ms)));
    EXPECT_FALSE(barrier.poll(at(7ms)).released);
    EXPECT_EQ(barrier.nextFrame(), 1_frame);
}

TEST(SwapBarrier, ReleasesAtOnceWithNobodyInIt) {
    SwapBarrier barrier(policy(LateFramePolicy::kWait));
    EXPECT_TRUE(barrier.begin(0_frame, at(0ms)).empty());
    EXPECT_LE(barrier.nextDeadline(), at(0ms));
    const SwapBarrier::Outcome outcome = barrier.poll(at(0ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_TRUE(outcome.show.empty());
    EXPECT_EQ(barrier.nextDeadline(), TimePoint::max());
}

TEST(SwapBarrier, TakesRepeatsAndStragglersButNoFuture) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    wholeFrame(barrier, 0ms, 5ms);
    barrier.begin(1_frame, at(10ms));
    EXPECT_TRUE(barrier.ready("a", 1_frame, at(12ms)));
    EXPECT_TRUE(barrier.ready("a", 1_frame, at(13ms)));
    EXPECT_TRUE(barrier.ready("b", 0_frame, at(13ms)));
    EXPECT_EQ(barrier.waitingFor(), Names{"b"});
    EXPECT_FALSE(barrier.ready("b", 2_frame, at(14ms)));
}

TEST(SwapBarrier, RefusesStrangers) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    barrier.begin(0_frame, at(0ms));
    const Expected<void> taken = barrier.ready("stranger", 0_frame, at(1ms));
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().message, "host 'stranger' says ready for frame 0 but is not in the barrier");
}

TEST(SwapBarrier, AHostThatEntersTakesPartFromTheNextFrame) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    barrier.begin(0_frame, at(0ms));
    barrier.enter("b");
    EXPECT_FALSE(barrier.ready("b", 0_frame, at(1ms)));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(1ms)));
    EXPECT_EQ(barrier.poll(at(1ms)).show, Names{"a"});
    EXPECT_EQ(barrier.begin(1_frame, at(2ms)), (Names{"a", "b"}));
}

TEST(SwapBarrier, LosingTheLastAwaitedHostReleasesTheFrame) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    barrier.leave("b");
    const SwapBarrier::Outcome outcome = barrier.poll(at(40ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.show, Names{"a"});
    EXPECT_EQ(outcome.lastHost, "b");
}

TEST(SwapBarrier, LosingEverybodyReleasesTheFrameToNobody) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    barrier.begin(0_frame, at(0ms));
    barrier.leave("a");
    const SwapBarrier::Outcome outcome = barrier.poll(at(1ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_TRUE(outcome.show.empty());
}

TEST(SwapBarrier, WaitsForAStragglerUpToTheDeadline) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    EXPECT_EQ(barrier.nextDeadline(), at(1'000ms));
    EXPECT_FALSE(barrier.poll(at(999ms)).released);
    const SwapBarrier::Outcome outcome = barrier.poll(at(1'000ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.stalled, Names{"b"});
    EXPECT_EQ(outcome.show, Names{"a"});
    EXPECT_FALSE(barrier.contains("b"));
}

TEST(SwapBarrier, IfNobodyDrawsAllHaveStalled) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kHold, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    EXPECT_FALSE(barrier.poll(at(999ms)).released);
    const SwapBarrier::Outcome outcome = barrier.poll(at(1'000ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.stalled, (Names{"a", "b"}));
    EXPECT_TRUE(outcome.show.empty());
}

TEST(SwapBarrier, TheDeadlineIsNeverUnderThreeTimesTheUsualFrame) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    for (int i = 0; i < 5; ++i) wholeFrame(barrier, i * 900ms, 800ms);
    EXPECT_EQ(barrier.frameDeadline(), 2'400ms);
    barrier.begin(5_frame, at(10s));
    EXPECT_FALSE(barrier.poll(at(12'399ms)).released);
    EXPECT_EQ(barrier.poll(at(12'400ms)).stalled, (Names{"a", "b"}));
}

TEST(SwapBarrier, TheFirstFrameHasADeadlineOfItsOwnUntilAllHaveDrawnOne) {
    SyncPolicy policy;
    policy.frameDeadline = 1'000ms;
    policy.firstFrameDeadline = 5'000ms;
    SwapBarrier barrier(policy);
    for (const char* host : {"a", "b"}) barrier.enter(host);
    barrier.begin(0_frame, at(0ms));
    EXPECT_TRUE(barrier.ready("a", 0_frame, at(100ms)));
    EXPECT_FALSE(barrier.poll(at(4'999ms)).released);
    EXPECT_EQ(barrier.nextDeadline(), at(5'000ms));
    EXPECT_TRUE(barrier.ready("b", 0_frame, at(4'999ms)));
    EXPECT_TRUE(barrier.poll(at(4'999ms)).released);
    // Three times the usual frame, which that one was.
    EXPECT_EQ(barrier.frameDeadline(), 3 * 4'999ms);
    policy.frameDeadline = 9'000ms;
    EXPECT_EQ(SwapBarrier(policy).frameDeadline(), 9'000ms) << "the longer of the two";
}

TEST(SwapBarrier, OneLongFrameDoesNotStretchTheDeadline) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    for (int i = 0; i < 4; ++i) wholeFrame(barrier, i * 20ms, 10ms);
    wholeFrame(barrier, 200ms, 900ms);
    EXPECT_EQ(barrier.frameDeadline(), 1'000ms);
}

TEST(SwapBarrier, HoldGoesOnWithoutTheLateHost) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kHold, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(200ms)));
    EXPECT_EQ(barrier.nextDeadline(), at(300ms));  // counted from the first Ready: a slow frame is not a late host
    EXPECT_FALSE(barrier.poll(at(299ms)).released);
    const SwapBarrier::Outcome outcome = barrier.poll(at(300ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.show, Names{"a"});
    EXPECT_EQ(outcome.held, Names{"b"});
    EXPECT_EQ(outcome.lastHost, "b");
    EXPECT_TRUE(barrier.contains("b"));
}

TEST(SwapBarrier, AHeldHostIsNotWaitedForUntilItHasDrawnTheOldFrame) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kHold, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    ASSERT_TRUE(barrier.poll(at(110ms)).released);
    EXPECT_EQ(barrier.begin(1_frame, at(111ms)), Names{"a"});
    ASSERT_TRUE(barrier.ready("a", 1_frame, at(120ms)));
    const SwapBarrier::Outcome second = barrier.poll(at(120ms));
    EXPECT_TRUE(second.released);
    EXPECT_EQ(second.held, Names{"b"});
    ASSERT_TRUE(barrier.ready("b", 0_frame, at(130ms)));
    EXPECT_EQ(barrier.begin(2_frame, at(140ms)), (Names{"a", "b"}));
}

TEST(SwapBarrier, AHeldHostThatNeverComesHasStalled) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kHold, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    ASSERT_TRUE(barrier.poll(at(110ms)).released);
    wholeFrame(barrier, 900ms, 50ms);
    EXPECT_EQ(barrier.nextDeadline(), at(1'000ms));
    const SwapBarrier::Outcome outcome = barrier.poll(at(1'000ms));
    EXPECT_FALSE(outcome.released);
    EXPECT_EQ(outcome.stalled, Names{"b"});
    EXPECT_FALSE(barrier.contains("b"));
}

TEST(SwapBarrier, NoFrameBeginsWhileOnlyHostsThatAreBehindAreLeft) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kHold, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    ASSERT_TRUE(barrier.poll(at(110ms)).released);
    barrier.shown("a", 0_frame, at(110ms));
    EXPECT_TRUE(barrier.mayBegin());
    barrier.leave("a");
    EXPECT_FALSE(barrier.mayBegin());
    ASSERT_TRUE(barrier.ready("b", 0_frame, at(150ms)));
    EXPECT_TRUE(barrier.mayBegin());
}

TEST(SwapBarrier, NoFrameBeginsBeforeAllSayThatTheyShowTheLast) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    releasedFrame(barrier, 10ms);
    EXPECT_FALSE(barrier.mayBegin());
    barrier.shown("a", 0_frame, at(11ms));
    // However long that takes: a host that answers is followed, up to lostAfter.
    for (const Duration time : {60ms, 400ms, 799ms}) {
        EXPECT_TRUE(barrier.poll(at(10ms + time)).unshown.empty());
        EXPECT_FALSE(barrier.mayBegin());
    }
    barrier.shown("b", 0_frame, at(809ms));
    EXPECT_TRUE(barrier.mayBegin());
    EXPECT_EQ(barrier.nextDeadline(), TimePoint::max());
    EXPECT_EQ(barrier.begin(1_frame, at(810ms)), (Names{"a", "b"}));
}

TEST(SwapBarrier, WhoNeverSaysThatItShowsHoldsTheOthersUpOnceAndIsOut) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    releasedFrame(barrier, 10ms);
    barrier.shown("a", 0_frame, at(11ms));
    EXPECT_EQ(barrier.nextDeadline(), at(810ms));
    EXPECT_TRUE(barrier.poll(at(900ms), at(809ms)).unshown.empty()) << "its word may lie unread";
    EXPECT_FALSE(barrier.mayBegin());
    const SwapBarrier::Outcome outcome = barrier.poll(at(810ms));
    EXPECT_EQ(outcome.unshown, Names{"b"});
    EXPECT_TRUE(outcome.stalled.empty());
    EXPECT_FALSE(barrier.contains("b"));
    EXPECT_TRUE(barrier.mayBegin());
    wholeFrame(barrier, 820ms, 5ms);
    EXPECT_TRUE(barrier.mayBegin()) << "nobody waits for it a second time";
}

TEST(SwapBarrier, TimeToShowRunsFromWhenItWasSaidNotFromTheEventThatIsHandledLate) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    (void)barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    ASSERT_TRUE(barrier.poll(at(10ms)).released);  // handled at 2 s
    EXPECT_LE(barrier.nextDeadline(), at(10ms)) << "the clock is to be looked at";
    barrier.told(at(2'000ms));
    EXPECT_TRUE(barrier.poll(at(2'000ms)).unshown.empty());
    EXPECT_EQ(barrier.nextDeadline(), at(2'800ms));
    EXPECT_EQ(barrier.poll(at(2'800ms)).unshown, Names{"a"});
}

TEST(SwapBarrier, WhoLeavesIsNotWaitedForToShow) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    releasedFrame(barrier, 10ms);
    barrier.shown("a", 0_frame, at(11ms));
    barrier.leave("b");
    EXPECT_TRUE(barrier.mayBegin());
    barrier.shown("b", 0_frame, at(12ms));  // harmless
    EXPECT_FALSE(barrier.contains("b"));
}

TEST(SwapBarrier, HoldAndDropWaitNoLongerForShowingThanForDrawing) {
    for (const LateFramePolicy late : {LateFramePolicy::kHold, LateFramePolicy::kDrop}) {
        SwapBarrier barrier = barrierOf(late, {"a", "b"});
        releasedFrame(barrier, 10ms);
        barrier.shown("a", 0_frame, at(11ms));
        EXPECT_EQ(barrier.nextDeadline(), at(110ms));
        (void)barrier.poll(at(109ms));
        EXPECT_FALSE(barrier.mayBegin());
        (void)barrier.poll(at(110ms));
        EXPECT_TRUE(barrier.mayBegin());
        EXPECT_EQ(barrier.nextDeadline(), at(810ms)) << "and is not asked for again and again";
        EXPECT_EQ(barrier.begin(1_frame, at(120ms)), (Names{"a", "b"}));
        ASSERT_TRUE(barrier.ready("a", 1_frame, at(130ms)));
        ASSERT_TRUE(barrier.ready("b", 1_frame, at(130ms)));
        ASSERT_TRUE(barrier.poll(at(130ms)).released);
        barrier.told(at(130ms));
        barrier.shown("a", 1_frame, at(131ms));
        EXPECT_EQ(barrier.poll(at(810ms)).unshown, Names{"b"}) << "since the first that it owes";
        EXPECT_FALSE(barrier.contains("b"));
    }
}

/// It draws no frame before it shows the one before: that is what it is to be called by.
TEST(SwapBarrier, WhoOwesAWordAndDrawsNoMoreIsNotCalledAStalledRenderer) {
    for (const LateFramePolicy late : {LateFramePolicy::kHold, LateFramePolicy::kDrop}) {
        SyncPolicy early = policy(late);
        early.frameDeadline = early.firstFrameDeadline = 300ms;
        early.lostAfter = 800ms;
        SwapBarrier barrier(early);
        for (const char* host : {"a", "b"}) barrier.enter(host);
        releasedFrame(barrier, 10ms);
        barrier.shown("a", 0_frame, at(11ms));
        (void)barrier.poll(at(110ms));
        EXPECT_EQ(barrier.begin(1_frame, at(120ms)), (Names{"a", "b"}));
        ASSERT_TRUE(barrier.ready("a", 1_frame, at(130ms)));
        (void)barrier.poll(at(230ms));
        const SwapBarrier::Outcome outcome = barrier.poll(at(120ms + barrier.frameDeadline()));
        EXPECT_TRUE(outcome.stalled.empty());
        EXPECT_EQ(outcome.unshown, Names{"b"});
        EXPECT_FALSE(barrier.contains("b"));
    }
}

/// Of usual frames the deadline is the policy's.
SwapBarrier barrierAfterShortFrames(const Names& hosts) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, hosts);
    for (int i = 0; i < 31; ++i) wholeFrame(barrier, -1ms, 1ms);
    return barrier;
}

/// Draws nothing until the deadline, and is entered again.
void stall(SwapBarrier& barrier, const std::string& host, Duration begun) {
    const FrameNumber frame = barrier.nextFrame();
    for (const std::string& name : barrier.begin(frame, at(begun)))
        if (name != host) ASSERT_TRUE(barrier.ready(name, frame, at(begun)));
    const SwapBarrier::Outcome outcome = barrier.poll(at(begun + 1'000ms));
    ASSERT_EQ(outcome.stalled, Names{host});
    for (const std::string& name : outcome.show) barrier.shown(name, frame, at(begun + 1'000ms));
    barrier.enter(host);
}

TEST(SwapBarrier, WhoHasHeldTheOthersUpIsWaitedForAgainOnceItHasDrawnAndShownAFrame) {
    SwapBarrier barrier = barrierAfterShortFrames({"a", "b"});
    stall(barrier, "b", 0ms);
    EXPECT_EQ(barrier.framesToProve("b"), 1u);
    EXPECT_EQ(barrier.framesToProve("a"), 0u);

    EXPECT_EQ(barrier.begin(32_frame, at(1'000ms)), (Names{"a", "b"}));
    EXPECT_EQ(barrier.nextDeadline(), at(2'000ms)) << "of a, which is waited for as ever";
    ASSERT_TRUE(barrier.ready("a", 32_frame, at(1'010ms)));
    EXPECT_EQ(barrier.nextDeadline(), at(1'110ms));
    EXPECT_FALSE(barrier.poll(at(1'109ms)).released);
    SwapBarrier::Outcome outcome = barrier.poll(at(1'110ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.held, Names{"b"});
    barrier.shown("a", 32_frame, at(1'110ms));
    EXPECT_EQ(barrier.begin(33_frame, at(1'120ms)), Names{"a"});
    ASSERT_TRUE(barrier.ready("a", 33_frame, at(1'130ms)));
    ASSERT_TRUE(barrier.poll(at(1'130ms)).released) << "b still draws an older one";
    barrier.shown("a", 33_frame, at(1'130ms));
    outcome = barrier.poll(at(2'000ms));
    EXPECT_EQ(outcome.stalled, Names{"b"});
    barrier.enter("b");
    EXPECT_EQ(barrier.framesToProve("b"), 1u) << "nobody has waited for it";

    EXPECT_EQ(barrier.begin(34_frame, at(2'000ms)), (Names{"a", "b"}));
    for (const char* host : {"a", "b"}) ASSERT_TRUE(barrier.ready(host, 34_frame, at(2'010ms)));
    ASSERT_TRUE(barrier.poll(at(2'010ms)).released);
    barrier.told(at(2'010ms));
    barrier.shown("a", 34_frame, at(2'011ms));
    EXPECT_EQ(barrier.framesToProve("b"), 1u) << "drawn, not shown";
    EXPECT_TRUE(barrier.mayBegin()) << "its word is not waited for";
    barrier.shown("b", 34_frame, at(2'012ms));
    EXPECT_EQ(barrier.framesToProve("b"), 0u);
    (void)barrier.begin(35_frame, at(2'020ms));
    ASSERT_TRUE(barrier.ready("a", 35_frame, at(2'030ms)));
    EXPECT_FALSE(barrier.poll(at(3'019ms)).released) << "it is waited for again";
    EXPECT_EQ(barrier.poll(at(3'020ms)).stalled, Names{"b"});
    barrier.enter("b");
    EXPECT_EQ(barrier.framesToProve("b"), 2u);
}

TEST(SwapBarrier, WhoShowsTooLateEachTimeHoldsTheOthersUpOnce) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a", "b"});
    releasedFrame(barrier, 10ms);
    barrier.shown("a", 0_frame, at(11ms));
    ASSERT_EQ(barrier.poll(at(810ms)).unshown, Names{"b"});
    for (int i = 0; i < 5; ++i) {
        const Duration now = 1'000ms * (i + 1);
        barrier.enter("b");
        const FrameNumber frame = barrier.nextFrame();
        releasedFrame(barrier, now);
        barrier.shown("a", frame, at(now + 1ms));
        EXPECT_TRUE(barrier.mayBegin());
        EXPECT_EQ(barrier.poll(at(now + 800ms)).unshown, Names{"b"});
    }
}

TEST(SwapBarrier, PicturesThatComeAfterTheOthersHaveGoneOnProveToo) {
    SwapBarrier barrier = barrierAfterShortFrames({"a", "b"});
    stall(barrier, "b", 0ms);
    (void)barrier.begin(32_frame, at(1'000ms));
    ASSERT_TRUE(barrier.ready("a", 32_frame, at(1'010ms)));
    ASSERT_TRUE(barrier.poll(at(1'110ms)).released);
    barrier.shown("a", 32_frame, at(1'110ms));
    ASSERT_TRUE(barrier.ready("b", 32_frame, at(1'300ms)));
    EXPECT_EQ(barrier.framesToProve("b"), 0u) << "an honest host that is slow is not left behind for ever";
    EXPECT_EQ(barrier.begin(33_frame, at(1'310ms)), (Names{"a", "b"}));
    ASSERT_TRUE(barrier.ready("a", 33_frame, at(1'320ms)));
    EXPECT_FALSE(barrier.poll(at(1'600ms)).released);
}

TEST(SwapBarrier, AHostByItselfIsWaitedForWhateverItHasDone) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"b"});
    (void)barrier.begin(0_frame, at(0ms));
    ASSERT_EQ(barrier.poll(at(1'000ms)).stalled, Names{"b"});
    barrier.enter("b");
    (void)barrier.begin(1_frame, at(1'000ms));
    EXPECT_FALSE(barrier.poll(at(1'999ms)).released);
    ASSERT_TRUE(barrier.ready("b", 1_frame, at(1'999ms)));
    EXPECT_EQ(barrier.poll(at(1'999ms)).show, Names{"b"});
}

/// Twice as many frames after each time, up to a bound; after as many in which it was waited for all is forgotten.
TEST(SwapBarrier, WhoHoldsTheOthersUpAgainAndAgainHasMoreAndMoreToProve) {
    SwapBarrier barrier = barrierAfterShortFrames({"a", "b"});
    Duration now{};
    const auto frame = [&] {
        wholeFrame(barrier, now, 1ms);
        now += 2ms;
    };
    for (std::uint32_t times = 0; times < 18; ++times) {
        stall(barrier, "b", now);
        now += 1'001ms;
        const std::uint32_t expected = std::uint32_t{1} << std::min(times, 16u);
        ASSERT_EQ(barrier.framesToProve("b"), expected);
        for (std::uint32_t i = 0; i < expected; ++i) frame();
        ASSERT_EQ(barrier.framesToProve("b"), 0u);
    }
    for (int i = 0; i < 65'536; ++i) frame();
    stall(barrier, "b", now);
    EXPECT_EQ(barrier.framesToProve("b"), 1u);
}

TEST(SwapBarrier, AReadyOfAHostThatLeftIsNoReasonToCallOthersLate) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kHold, {"a", "b", "c"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    barrier.leave("a");
    EXPECT_FALSE(barrier.poll(at(200ms)).released);
    ASSERT_TRUE(barrier.ready("b", 0_frame, at(210ms)));
    EXPECT_FALSE(barrier.poll(at(211ms)).released);
    EXPECT_EQ(barrier.nextDeadline(), at(310ms));
}

TEST(SwapBarrier, DropsAStragglerUntilItIsEnteredAgain) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kDrop, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    const SwapBarrier::Outcome outcome = barrier.poll(at(110ms));
    EXPECT_TRUE(outcome.released);
    EXPECT_EQ(outcome.held, Names{"b"});
    EXPECT_FALSE(barrier.contains("b"));
    EXPECT_TRUE(barrier.ready("b", 0_frame, at(120ms)));  // it was told to draw it
    EXPECT_EQ(barrier.begin(1_frame, at(130ms)), Names{"a"});
    ASSERT_TRUE(barrier.ready("a", 1_frame, at(131ms)));
    EXPECT_TRUE(barrier.poll(at(131ms)).held.empty());
    barrier.enter("b");
    EXPECT_EQ(barrier.begin(2_frame, at(132ms)), (Names{"a", "b"}));
}

TEST(SwapBarrier, ADroppedHostThatNeverComesHasStalled) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kDrop, {"a", "b"});
    barrier.begin(0_frame, at(0ms));
    ASSERT_TRUE(barrier.ready("a", 0_frame, at(10ms)));
    ASSERT_TRUE(barrier.poll(at(110ms)).released);
    EXPECT_EQ(barrier.poll(at(1'000ms)).stalled, Names{"b"});
}

TEST(SwapBarrierDeathTest, FramesBeginOneAfterTheOther) {
    SwapBarrier barrier = barrierOf(LateFramePolicy::kWait, {"a"});
    EXPECT_DEATH(barrier.begin(1_frame, at(0ms)), "one after the other");
    barrier.begin(0_frame, at(0ms));
    EXPECT_DEATH(barrier.begin(1_frame, at(0ms)), "another one is open");
}

}  // namespace
}  // namespace tessera
