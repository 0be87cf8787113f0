/// When the next frame may begin, on a clock of the test's own.
#include "server/sim/FramePacing.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kStart{1h};

TEST(FramePacing, TheFirstFrameMayBeginAtOnce) {
    FramePacing pacing(60);
    EXPECT_LE(pacing.earliest(), kStart);
    EXPECT_FALSE(pacing.frameOpen());
}

TEST(FramePacing, WithoutARateTheNextMayBeginAtOnce) {
    FramePacing pacing(0);
    pacing.began(kStart);
    EXPECT_TRUE(pacing.frameOpen());
    pacing.released(kStart + 3ms, false);
    EXPECT_FALSE(pacing.frameOpen());
    EXPECT_EQ(pacing.framesReleased(), 1u);
    EXPECT_LE(pacing.earliest(), kStart + 3ms);
}

TEST(FramePacing, FramesOnTimeKeepTheRateAndALateOneIsNotCaughtUp) {
    FramePacing pacing(100);
    for (int i = 0; i < 5; ++i) {
        pacing.began(kStart + i * 10ms);
        pacing.released(kStart + i * 10ms + 4ms, false);
        ASSERT_EQ(pacing.earliest(), kStart + (i + 1) * 10ms);
    }
    pacing.began(kStart + 75ms);  // 50 was due
    pacing.released(kStart + 76ms, false);
    EXPECT_EQ(pacing.earliest(), kStart + 85ms);
}

TEST(FramePacing, FramesLastAsLongAsOfLate) {
    FramePacing pacing(0);
    TimePoint at = kStart;
    for (int i = 0; i < 100; ++i, at += 30ms) {
        pacing.began(at);
        pacing.released(at + 25ms, false);
    }
    EXPECT_NEAR(toMilliseconds(pacing.usualLength()), 25, 0.01);
    pacing.began(at);
    pacing.released(at + 1h, false);  // for a host that was lost
    EXPECT_LT(pacing.usualLength(), 60ms);
}

TEST(FramePacing, AWallWhereNobodyDrawsKeepsThePaceOfTheClock) {
    FramePacing pacing(0);
    pacing.began(kStart);
    pacing.released(kStart, true);
    const Duration sixtieth = pacing.earliest() - kStart;
    EXPECT_NEAR(toMilliseconds(sixtieth), 1000.0 / 60, 1e-6);
}

}  // namespace
}  // namespace tessera
