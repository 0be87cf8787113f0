// What people say of exposures; light that is counted, and what comes of it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/wall/Exposure.h"
#include "common/wall/LightHistogram.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

using Pixels = std::array<std::uint64_t, LightHistogram::kClasses>;

int classOf(double stops) {
    return static_cast<int>(std::floor((stops - LightHistogram::kLeastStops) * LightHistogram::kClassesPerStop)) + 1;
}
Pixels of(std::initializer_list<std::pair<double, std::uint64_t>> stopsAndPixels) {
    Pixels pixels{};
    for (const auto& [stops, count] : stopsAndPixels) pixels[static_cast<std::size_t>(classOf(stops))] += count;
    return pixels;
}

TEST(Exposure, IsSaidInWords) {
    EXPECT_EQ(*parseExposure("metered"), (ExposureWish{.stops = {}, .metered = true, .toneMap = {}}));
    EXPECT_EQ(*parseExposure("off"), (ExposureWish{.stops = 0.0, .metered = false, .toneMap = {}}));
    EXPECT_EQ(*parseExposure("+2"), (ExposureWish{.stops = 2.0, .metered = false, .toneMap = {}}))
        << "as it is printed";
    EXPECT_FALSE(parseExposure("+"));
    EXPECT_FALSE(parseExposure("+-2"));
    EXPECT_EQ(*parseExposure("-12.5"), (ExposureWish{.stops = -12.5, .metered = false, .toneMap = {}}));
    for (const char* wrong : {"", "on", "1.5x", "41", "-41", "nan", "inf", "1e999"}) {
        EXPECT_FALSE(parseExposure(wrong)) << wrong;
        EXPECT_NE(exposureFault(wrong), "") << wrong;
    }
    EXPECT_EQ(exposureFault("3"), "");
    EXPECT_EQ(*parseToneMap("agx"), ToneMap::kAgx);
    EXPECT_WORDS(parseToneMap("filmic").error().message);
}

TEST(LightHistogram, OneBrightnessBecomesTheMiddle) {
    for (const double stops : {-9.0, -2.0, 0.0, 5.5, 17.0}) {
        const auto exposure = exposureFor(of({{stops, 1000}}));
        ASSERT_TRUE(exposure) << stops;
        EXPECT_NEAR(std::exp2(stops + *exposure), kMiddle, 0.06 * kMiddle) << "a sixteenth of a stop";
    }
}

TEST(LightHistogram, LampsGlintsAndTheDarkDoNotCount) {
    const double lit = *exposureFor(of({{3, 1000}}));
    EXPECT_NEAR(*exposureFor(of({{3, 1000}, {12, 19}})), lit, 0.01);
    EXPECT_NEAR(*exposureFor(of({{3, 1000}, {-6, 5000}})), lit, 0.01);
    EXPECT_GT(*exposureFor(of({{3, 1000}, {1, 1000}})), lit + 0.5) << "what is in the shade does";
    Pixels unseen = of({{3, 1000}});
    unseen[0] = 100'000;  // background and unlit things
    EXPECT_EQ(*exposureFor(unseen), lit);
}

TEST(LightHistogram, NothingLitSaysNothing) {
    EXPECT_FALSE(exposureFor(Pixels{}));
    Pixels dark{};
    dark[0] = 100;
    dark[1] = 100;
    EXPECT_FALSE(exposureFor(dark));
}

TEST(LightHistogram, EachPixelOfAScreenCountsOnceForEachEyeAndUser) {
    const auto tile = [](const char* name, PixelRect rect, Eye eye = Eye::kCenter, const char* user = "a",
                         const char* screen = "front") {
        Tile made;
        made.name = name;
        made.screen = screen;
        made.eye = eye;
        made.user = user;
        made.rect = rect;
        return made;
    };
    const PixelRect left{.x = 0, .y = 0, .width = 100, .height = 50},
        right{.x = 90, .y = 0, .width = 100, .height = 50};
    const std::vector<Tile> tiles = {tile("l", left),
                                     tile("r", right),
                                     tile("l left", left, Eye::kLeft),
                                     tile("l of b", left, Eye::kCenter, "b"),
                                     tile("side", left, Eye::kCenter, "a", "side"),
                                     tile("beyond", {.x = 190, .y = 0, .width = 10, .height = 50}),
                                     tile("l again", left)};
    const std::vector<std::size_t> before = {0, 1, 0, 0, 0, 0, 2};
    for (std::size_t i = 0; i < tiles.size(); ++i)
        EXPECT_EQ(countedElsewhere(tiles, tiles[i]).size(), before[i]) << tiles[i].name;
    EXPECT_EQ(countedElsewhere(tiles, tiles[1]).front(), left);
}

TEST(LightHistogram, ASquareIsItsOwnPixelsWhereverARectangleBegins) {
    for (int from = 0; from < 40; ++from) {
        int first = 0;
        while (LightHistogram::kSquarePx * first + LightHistogram::kPlaceInSquare < from) ++first;
        EXPECT_EQ(LightHistogram::squareFrom(from), first) << from;
    }
}

}  // namespace
}  // namespace tessera
