#include "tests/drill/FrameTimeline.h"

#include <gtest/gtest.h>

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

TimePoint at(int ms) {
    return TimePoint(std::chrono::milliseconds(ms));
}

/// 50 frames a second of two hosts; the right one is away from 200 to 400 ms, and nobody shows anything from 200 to
/// 300.
FrameTimeline withAGap() {
    FrameTimeline timeline(50);
    for (int t = 0; t <= 1000; t += 20)
        if (t <= 200 || t >= 300)
            timeline.add({.at = at(t),
                          .hosts = t > 200 && t < 400 ? std::vector<std::string>{"left"}
                                                      : std::vector<std::string>{"left", "right"}});
    return timeline;
}

TEST(FrameTimeline, AStandstillIsAsManyFramesAsTheWallWouldHaveShown) {
    const FrameTimeline timeline = withAGap();
    EXPECT_EQ(timeline.longestGap(at(0), at(1000)), 100ms);
    EXPECT_EQ(timeline.missed(at(0), at(1000)), 4);
    EXPECT_EQ(timeline.missed(at(400), at(1000)), 0);
}

TEST(FrameTimeline, AStandstillThatLastsAtTheEndCountsWithItsPart) {
    EXPECT_EQ(withAGap().longestGap(at(100), at(260)), 60ms);
    EXPECT_EQ(withAGap().longestGap(at(1000), at(3000)), 2000ms);
}

TEST(FrameTimeline, AFrameThatNobodyShowedEndsNoStandstill) {
    FrameTimeline timeline(50);
    timeline.add({.at = at(0), .hosts = {"left"}});
    timeline.add({.at = at(20), .hosts = {}});
    timeline.add({.at = at(40), .hosts = {"left"}});
    EXPECT_EQ(timeline.longestGap(at(0), at(40)), 40ms);
}

TEST(FrameTimeline, SaysWhenAHostWentAndWhenItCameBack) {
    const FrameTimeline timeline = withAGap();
    EXPECT_EQ(timeline.firstWithout("right", at(0)), at(300));
    EXPECT_EQ(timeline.firstWith("right", at(300)), at(400));
    EXPECT_FALSE(timeline.firstWithout("left", at(0)));
}

TEST(FrameTimeline, SaysFromWhenOnTheWallIsWhole) {
    FrameTimeline timeline = withAGap();
    EXPECT_EQ(timeline.wholeFrom({"left", "right"}, at(0)), at(400));
    EXPECT_EQ(timeline.wholeFrom({"left"}, at(0)), at(0));
    timeline.add({.at = at(1020), .hosts = {"left"}});
    EXPECT_FALSE(timeline.wholeFrom({"left", "right"}, at(0)));
}

TEST(FrameTimeline, QuantilesAreValuesThatWereSeen) {
    EXPECT_EQ(quantile({5, 1, 3}, 0.5), 3);
    EXPECT_EQ(quantile({5, 1, 3}, 1), 5);
    EXPECT_EQ(quantile({}, 0.5), 0);
}

}  // namespace
}  // namespace tessera::drill
