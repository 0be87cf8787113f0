/// Two eyes in one picture: which pixel goes where, and what colours become.
#include "client/output/StereoPack.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/output/OutputTable.h"
#include "tests/unit/output/OutputScenes.h"

namespace tessera::test {
namespace {

constexpr StereoPacking kPackings[] = {StereoPacking::kSideBySide,   StereoPacking::kSideBySideFull,
                                       StereoPacking::kTopBottom,    StereoPacking::kTopBottomFull,
                                       StereoPacking::kAnaglyph,     StereoPacking::kAnaglyphPlain,
                                       StereoPacking::kRows,         StereoPacking::kColumns,
                                       StereoPacking::kCheckerboard, StereoPacking::kQuadBuffered};

double lightOfMean(int a, int b) {
    const auto light = [](int v) { return std::pow(v / 255.0, 2.2); };
    return 255 * std::pow((light(a) + light(b)) / 2, 1 / 2.2);
}

double fromSrgb(int value) {
    const double v = value / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}
double toSrgb(double light) {
    light = std::clamp(light, 0.0, 1.0);
    return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055);
}

/// Dark light of sRGB is known to a twentieth of a value: tables of 65536 steps.
/// What a channel of a packed pixel has to be, by the words of StereoPack.h.
double expectedAt(StereoPacking packing, const EyePictures& eyes, int x, int y, std::size_t c) {
    const int w = eyes.widthPx, h = eyes.heightPx;
    const auto left = [&](int px, int py, std::size_t channel) { return channelAt(eyes.left, w, px, py, channel); };
    const auto right = [&](int px, int py, std::size_t channel) { return channelAt(eyes.right, w, px, py, channel); };
    switch (packing) {
        case StereoPacking::kSideBySide:
            return x < w / 2 ? lightOfMean(left(2 * x, y, c), left(2 * x + 1, y, c))
                             : lightOfMean(right(2 * x - w, y, c), right(2 * x - w + 1, y, c));
        case StereoPacking::kTopBottom:
            return y < h / 2 ? lightOfMean(left(x, 2 * y, c), left(x, 2 * y + 1, c))
                             : lightOfMean(right(x, 2 * y - h, c), right(x, 2 * y - h + 1, c));
        case StereoPacking::kSideBySideFull:
        case StereoPacking::kQuadBuffered:
            return x < w ? left(x, y, c) : right(x - w, y, c);
        case StereoPacking::kTopBottomFull:
            return y < h ? left(x, y, c) : right(x, y - h, c);
        case StereoPacking::kAnaglyphPlain:
            return c == 0 ? left(x, y, c) : right(x, y, c);
        case StereoPacking::kRows:
            return y % 2 == 0 ? left(x, y, c) : right(x, y, c);
        case StereoPacking::kColumns:
            return x % 2 == 0 ? left(x, y, c) : right(x, y, c);
        case StereoPacking::kCheckerboard:
            return (x + y) % 2 == 0 ? left(x, y, c) : right(x, y, c);
        case StereoPacking::kAnaglyph: {
            constexpr double kLeft[3][3] = {{437, 449, 164}, {-62, -62, -24}, {-48, -50, -17}},
                             kRight[3][3] = {{-11, -32, -7}, {377, 761, 9}, {-26, -93, 1234}};
            double light = 0;
            for (std::size_t i = 0; i < 3; ++i)
                light += kLeft[c][i] * fromSrgb(left(x, y, i)) / 1000 + kRight[c][i] * fromSrgb(right(x, y, i)) / 1000;
            return toSrgb(light);
        }
        case StereoPacking::kNone:
            break;
    }
    return -1;
}

TEST(StereoPack, PutsEachPixelWhereItBelongs) {
    for (unsigned seed = 0; seed < 30; ++seed) {
        std::mt19937 random(seed);
        const int width = 2 * std::uniform_int_distribution<int>(1, 40)(random),
                  height = 2 * std::uniform_int_distribution<int>(1, 30)(random);
        const auto left = noise(random, width, height), right = noise(random, width, height);
        const EyePictures eyes{left.data(), right.data(), width, height};
        for (const StereoPacking packing : kPackings) {
            const PackedSize size = packedSize(packing, width, height);
            auto out = even(size.widthPx, size.heightPx, 1);
            packEyes(packing, eyes, {out.data(), 4 * static_cast<std::size_t>(size.widthPx)});
            for (int y = 0; y < size.heightPx; ++y)
                for (int x = 0; x < size.widthPx; ++x)
                    for (std::size_t c = 0; c < 3; ++c)
                        ASSERT_NEAR(channelAt(out.data(), size.widthPx, x, y, c), expectedAt(packing, eyes, x, y, c),
                                    packing == StereoPacking::kAnaglyph ? 0.6 : 0.51)
                            << again("StereoPack.Puts*", seed) << " packing " << static_cast<int>(packing) << " at "
                            << x << ' ' << y;
        }
    }
}

TEST(StereoPack, GreysStayGreyThroughRedCyanGlasses) {
    for (int value = 0; value < 256; ++value) {
        const auto grey = even(1, 1, static_cast<std::uint8_t>(value));
        std::uint8_t out[4] = {};
        packEyes(StereoPacking::kAnaglyph, {grey.data(), grey.data(), 1, 1}, {out, 4});
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(out[c], value, 2) << "the matrices' rows add up to 1, to three digits";
    }
}

/// The whole way: eyes swapped, each eye warped, coloured and then packed; colours mixed first.
TEST(StereoPack, OutputsTakeBothTilesOfTheirHost) {
    std::mt19937 random(8);
    for (const bool swap : {false, true}) {
        for (const StereoPacking packing : kPackings) {
            Wall wall = flatWall(1, 1, 16, 12, 0, 0, true);
            TileOutput& out = wall.hosts[0].tiles[0].output;
            out.stereo = packing;
            out.swapEyes = swap;
            out.flipX = true;
            ASSERT_FALSE(findWallFault(wall)) << findWallFault(wall)->message;
            const auto tiles = outputsOf(wall, layoutTiles(wall));
            ASSERT_EQ(tiles.size(), 1u);
            auto maker = OutputMaker::make(wall, tiles[0].name).value();
            EXPECT_EQ(maker.tiles(), (std::vector<std::string>{"s-0-0-left", "s-0-0-right"}));
            const auto left = noise(random, 16, 12), right = noise(random, 16, 12);
            const std::uint8_t* const pictures[2] = {left.data(), right.data()};
            const std::uint8_t* const got = maker.draw(pictures);
            const auto turned = [](const std::vector<std::uint8_t>& picture) {
                auto to = picture;
                for (std::size_t y = 0; y < 12; ++y)
                    for (std::size_t x = 0; x < 16; ++x)
                        std::copy_n(picture.begin() + static_cast<std::ptrdiff_t>(4 * (16 * y + x)), 4,
                                    to.begin() + static_cast<std::ptrdiff_t>(4 * (16 * y + 15 - x)));
                return to;
            };
            const auto a = turned(swap ? right : left), b = turned(swap ? left : right);
            const EyePictures eyes{a.data(), b.data(), 16, 12};
            for (int y = 0; y < maker.heightPx(); ++y)
                for (int x = 0; x < maker.widthPx(); ++x)
                    ASSERT_NEAR(channelAt(got, maker.widthPx(), x, y, 1), expectedAt(packing, eyes, x, y, 1),
                                packing == StereoPacking::kAnaglyph ? 0.6 : 0.51)
                        << static_cast<int>(packing) << swap << ' ' << x << ' ' << y;
        }
    }
}

}  // namespace
}  // namespace tessera::test
