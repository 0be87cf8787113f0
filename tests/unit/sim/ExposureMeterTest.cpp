#include "server/sim/view/ExposureMeter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace tessera {
namespace {

HostStats statsOf(double stops, std::uint32_t pixels = 1000) {
    HostStats stats;
    stats.light.emplace();
    const double place = (stops - LightHistogram::kLeastStops) * LightHistogram::kClassesPerStop;
    stats.light->pixels[static_cast<std::size_t>(place) + 1] = pixels;
    return stats;
}
void frame(ExposureMeter& meter, std::initializer_list<double> hosts) {
    int number = 0;
    for (const double stops : hosts) meter.drawn("host " + std::to_string(number++), statsOf(stops));
    meter.released();
}

TEST(ExposureMeter, TheFirstFrameSetsItAndAStillWallNeverMovesIt) {
    ExposureMeter meter({});
    EXPECT_EQ(meter.exposure(), Exposure());
    frame(meter, {14, 14});
    const std::int32_t found = meter.exposure().found;
    EXPECT_NEAR(meter.exposure().foundStops(), std::log2(kMiddle) - 14, 0.1);
    for (int i = 0; i < 1000; ++i) frame(meter, {14, 14});
    EXPECT_EQ(meter.exposure().found, found);
    EXPECT_EQ(meter.changes(), 1u);
    EXPECT_TRUE(meter.meters());
}

TEST(ExposureMeter, FollowsInSmallStepsComesToRestAndStaysForLittle) {
    ExposureMeter meter({});
    frame(meter, {0});
    const std::int32_t from = meter.exposure().found;
    for (int i = 0; i < 100; ++i) frame(meter, {0.25});
    EXPECT_EQ(meter.exposure().found, from) << "a quarter of a stop is not worth a redraw";
    std::int32_t last = from;
    int frames = 0;
    for (; frames < 500; ++frames) {
        frame(meter, {10});
        const std::int32_t now = meter.exposure().found;
        if (now == last) break;
        EXPECT_LT(now, last) << "it never swings";
        EXPECT_LE(last - now, (last - (from - 10 * 64)) / ExposureMeter::kEase + 1);
        last = now;
    }
    EXPECT_EQ(last, from - 10 * 64);
    EXPECT_GT(frames, 30);
    EXPECT_LT(frames, 120) << "two seconds";
    const std::uint64_t changes = meter.changes();
    for (int i = 0; i < 100; ++i) frame(meter, {10});
    EXPECT_EQ(meter.changes(), changes);
}

TEST(ExposureMeter, DoesNotDependOnHowHostsShareOutTheWallOrWhoIsFirst) {
    ExposureMeter one({}), four({});
    HostStats all;
    all.light.emplace();
    std::vector<HostStats> parts(4, all);
    for (int i = 1; i < LightHistogram::kClasses; ++i) {
        const auto at = static_cast<std::size_t>(i);
        all.light->pixels[at] = static_cast<std::uint32_t>(i * 37 % 101);
        for (std::uint32_t k = 0; k < all.light->pixels[at]; ++k) ++parts[(k * 7 + at) % 4].light->pixels[at];
    }
    one.drawn("big", all);
    one.released();
    for (const int host : {2, 0, 3, 1})
        four.drawn("host " + std::to_string(host), parts[static_cast<std::size_t>(host)]);
    four.released();
    EXPECT_EQ(four.exposure(), one.exposure());
    EXPECT_NE(one.exposure().found, 0);
}

TEST(ExposureMeter, ALateHostCountsAsItWasAndNothingLitChangesNothing) {
    ExposureMeter meter({});
    frame(meter, {0, 6});
    const Exposure before = meter.exposure();
    for (int i = 0; i < 10; ++i) frame(meter, {0});  // the second host is late, or lost
    EXPECT_EQ(meter.exposure(), before);
    HostStats dark;
    dark.light.emplace();
    for (const char* host : {"host 0", "host 1"}) meter.drawn(host, dark);
    meter.released();
    EXPECT_EQ(meter.exposure(), before);
}

TEST(ExposureMeter, EndsWhereNobodyMetersBeginsAnewAndDoesNotFlashBetween) {
    ExposureMeter meter({});
    frame(meter, {10});
    meter.released();  // of no live host: the wall waits
    EXPECT_NE(meter.exposure().found, 0);
    meter.drawn("host 0", HostStats());
    meter.released();
    EXPECT_NEAR(meter.exposure().foundStops(), std::log2(kMiddle) - 10, 0.1) << "the next metered frame begins there";
    EXPECT_FALSE(meter.meters());
    frame(meter, {-3});
    EXPECT_NEAR(meter.exposure().foundStops(), std::log2(kMiddle) + 3, 0.1) << "at once";
}

TEST(ExposureMeter, WishesStayUntilTheyAreSaidOrResetAnew) {
    ExposureMeter meter({.stops = 2.0, .metered = false, .toneMap = {}});
    meter.ask({.stops = {}, .metered = {}, .toneMap = ToneMap::kAces}, false);
    EXPECT_EQ(meter.exposure().wish, (ExposureWish{.stops = 2.0, .metered = false, .toneMap = ToneMap::kAces}));
    meter.ask({.stops = {}, .metered = true, .toneMap = {}}, false);
    EXPECT_EQ(meter.exposure().wish, (ExposureWish{.stops = {}, .metered = true, .toneMap = ToneMap::kAces}))
        << "with the scene's stops";
    meter.ask({.stops = -1.0, .metered = true, .toneMap = {}}, false);
    EXPECT_EQ(meter.exposure().wish, (ExposureWish{.stops = -1.0, .metered = true, .toneMap = ToneMap::kAces}));
    meter.ask({.stops = {}, .metered = true, .toneMap = {}}, true);
    EXPECT_EQ(meter.exposure().wish, (ExposureWish{.stops = {}, .metered = true, .toneMap = {}}));
    meter.ask({}, true);
    EXPECT_EQ(meter.exposure().wish, ExposureWish());
}

}  // namespace
}  // namespace tessera
