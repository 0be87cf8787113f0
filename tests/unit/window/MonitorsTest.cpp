/// Where windows go: monitors by number and name, parts of a screen side by side, pictures in the middle.
#include "client/window/Monitors.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

const std::vector<Monitor> kTwo = {
    {.name = "DELL U2412M", .all = {0, 0, 1920, 1200}, .usable = {0, 30, 1920, 1170}, .refreshHz = 60},
    {.name = "0", .all = {1920, 0, 3840, 2160}, .usable = {1920, 0, 3840, 2160}, .refreshHz = 0}};

TEST(Monitors, AreFoundByNameWhateverItsCapitalsAndElseByNumber) {
    EXPECT_EQ(findMonitor(kTwo, "dell u2412m").value(), 0u);
    EXPECT_EQ(findMonitor(kTwo, "1").value(), 1u);
    EXPECT_EQ(findMonitor(kTwo, "0").value(), 1u);  // a name comes first
}

TEST(Monitors, OthersAreRefusedAndThoseThatThereAreAreSaid) {
    for (const char* wanted : {"2", "-1", "", "HDMI-1", "1 ", "01"}) {
        const auto found = findMonitor(kTwo, wanted);
        ASSERT_FALSE(found) << wanted;
        EXPECT_EQ(found.error().code, ErrorCode::kNotFound);
        EXPECT_WORDS(found.error().message);
    }
    const auto twins = findMonitor({kTwo[0], kTwo[0]}, "DELL U2412M");
    ASSERT_FALSE(twins);
    EXPECT_WORDS(twins.error().message);
    EXPECT_EQ(findMonitor({kTwo[0], kTwo[0]}, "1").value(), 1u);
}

TEST(Monitors, PartsOfAScreenMeetAndLieOnTheDesktop) {
    const DesktopRect usable{100, 40, 1700, 1000};
    for (unsigned seed = 0; seed < 2'000; ++seed) {
        std::mt19937 random(seed);
        const auto upTo = [&](int most) { return std::uniform_int_distribution<int>(1, most)(random); };
        const int columns = upTo(5), rows = upTo(4), width = upTo(3000), height = upTo(2000);
        const int whole = columns * width, high = rows * height;
        const auto place = [&](int column, int row) {
            return placeOnDesktop({{column * width, row * height, width, height}, whole, high}, usable);
        };
        const DesktopRect first = place(0, 0), last = place(columns - 1, rows - 1);
        EXPECT_GE(first.x, usable.x);
        EXPECT_GE(first.y, usable.y);
        EXPECT_LE(last.x + last.width, usable.x + usable.width) << "seed " << seed;
        EXPECT_LE(last.y + last.height, usable.y + usable.height) << "seed " << seed;
        // A pixel stays a pixel where there is room for all.
        if (whole <= 0.9 * usable.width && high <= 0.9 * usable.height) {
            EXPECT_EQ(first.width, width);
            EXPECT_EQ(first.height, height);
        }
        for (int column = 1; column < columns; ++column) {
            // Thinner than a pixel: at least one is kept.
            if (place(column - 1, 0).width > 1) {
                EXPECT_EQ(place(column - 1, 0).x + place(column - 1, 0).width, place(column, 0).x) << "seed " << seed;
            }
        }
    }
}

TEST(Monitors, PicturesKeepTheirShapeInTheMiddle) {
    EXPECT_EQ(fitted(640, 360, 640, 360), (DesktopRect{0, 0, 640, 360}));
    EXPECT_EQ(fitted(640, 360, 1280, 800), (DesktopRect{0, 40, 1280, 720}));
    EXPECT_EQ(fitted(360, 640, 1280, 640), (DesktopRect{460, 0, 360, 640}));
    EXPECT_EQ(fitted(16384, 1, 100, 100), (DesktopRect{0, 49, 100, 1}));
    EXPECT_EQ(fitted(1, 16384, 100, 100), (DesktopRect{49, 0, 1, 100}));
    EXPECT_EQ(fitted(5, 5, 0, 0), (DesktopRect{0, 0, 1, 1}));
}

}  // namespace
}  // namespace tessera
