/// Smaller pictures: each pixel is the mean of those it stands for, whatever the sides.
#include "common/image/Shrink.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

/// By the definition, one pixel after the other.
std::uint8_t meanAt(const Picture& picture, int by, int x, int y, int channel) {
    unsigned sum = 0, count = 0;
    for (int j = y * by; j < std::min(picture.heightPx, (y + 1) * by); ++j)
        for (int i = x * by; i < std::min(picture.widthPx, (x + 1) * by); ++i, ++count)
            sum += picture.rgb[static_cast<std::size_t>(3 * (j * picture.widthPx + i) + channel)];
    return static_cast<std::uint8_t>((sum + count / 2) / count);
}

TEST(Shrunk, IsTheMeanOfEachBlock) {
    std::mt19937 random(3);
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(7, 5), std::pair(64, 64), std::pair(130, 3)}) {
        Picture picture{.widthPx = width, .heightPx = height, .rgb = {}};
        for (int i = 0; i < 3 * width * height; ++i) picture.rgb.push_back(static_cast<std::uint8_t>(random()));
        for (const int by : {1, 2, 3, 4, 16, 64}) {
            const Picture small = shrunk(picture, by);
            ASSERT_EQ(small.widthPx, (width + by - 1) / by);
            ASSERT_EQ(small.heightPx, (height + by - 1) / by);
            for (int y = 0; y < small.heightPx; ++y)
                for (int x = 0; x < small.widthPx; ++x)
                    for (int c = 0; c < 3; ++c)
                        ASSERT_EQ(small.rgb[static_cast<std::size_t>(3 * (y * small.widthPx + x) + c)],
                                  meanAt(picture, by, x, y, c))
                            << by << ": " << x << " " << y;
        }
    }
    EXPECT_EQ(shrunk(Picture::filled(200, 200, 255, 0, 128), 64).rgb[0], 255) << "no sum overflows";
}

TEST(Shrunk, TakesPixelsOfFourBytesWhereTheyLie) {
    const std::uint8_t pixels[] = {10, 20, 30, 99, 20, 40, 50, 99, 7, 7, 7, 7};  // a pitch of three pixels
    const PixelsSeen seen{.first = pixels, .pitchBytes = 12, .bytesPerPixel = 4, .widthPx = 2, .heightPx = 1};
    const Picture small = shrunk(seen, 2);
    EXPECT_EQ(small.rgb, (std::vector<std::uint8_t>{15, 30, 40}));
}

}  // namespace
}  // namespace tessera
