#include <gtest/gtest.h>

#include "server/sim/journal/NextEpoch.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Instant = std::chrono::system_clock::time_point;

TEST(NextEpoch, IsTheClocksWhereThatIsHigher) {
    EXPECT_EQ(nextEpoch({}, Instant(1000s)), Epoch(1'000'000'000'000));
    EXPECT_EQ(nextEpoch(5_epoch, Instant(1000s)), Epoch(1'000'000'000'000));
}

TEST(NextEpoch, GrowsEvenIfTheClockGoesBack) {
    const Epoch last = nextEpoch({}, Instant(1000s));
    EXPECT_GT(nextEpoch(last, Instant(999s)), last);
    EXPECT_GT(nextEpoch(last, Instant(1000s)), last) << "or stands still";
    EXPECT_GT(nextEpoch(last, Instant(-5s)), last) << "or is before 1970";
}

TEST(NextEpoch, IsNeverNone) {
    EXPECT_TRUE(nextEpoch({}, Instant(0s)));
    EXPECT_TRUE(nextEpoch({}, Instant(-5s)));
}

TEST(NextEpoch, TheFurthestThatIsBelievedGrowsWithTheClockAndReachesOverOneThatFellBack) {
    const Instant today = Instant(std::chrono::years(56));
    EXPECT_GT(furthestEpoch(today + 1ns), furthestEpoch(today));
    EXPECT_GT(furthestEpoch(Instant(0s)), nextEpoch({}, today));
    EXPECT_TRUE(furthestEpoch(Instant(std::chrono::years(200))).next());
}

}  // namespace
}  // namespace tessera
