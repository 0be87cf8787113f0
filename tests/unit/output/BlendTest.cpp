/// Overlapping projectors make one picture: light and black add up, blend pictures that do not are found.
#include <gtest/gtest.h>

#include <cmath>

#include "common/output/BlendExcess.h"
#include "common/output/BlendPicture.h"
#include "tests/support/words/Words.h"
#include "tests/unit/output/OutputScenes.h"

namespace tessera::test {
namespace {

struct BlendedWall {
    Wall wall;
    double gamma = 2.2, black = 0;
};

BlendedWall randomWall(std::mt19937& random) {
    const auto upTo = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
    const int columns = upTo(1, 4), rows = upTo(1, 3);
    BlendedWall made{.wall = flatWall(columns, rows, 20, 20)};
    Screen::Grid& g = made.wall.screens[0].grid;
    for (int c = 0; c < columns; ++c) g.columnWidthsPx.push_back(upTo(11, 60));
    for (int r = 0; r < rows; ++r) g.rowHeightsPx.push_back(upTo(11, 60));
    g.tileWidthPx = g.columnWidthsPx[0];
    g.tileHeightPx = g.rowHeightsPx[0];
    g.overlapXPx = upTo(0, *std::ranges::min_element(g.columnWidthsPx) / 2);
    g.overlapYPx = upTo(g.overlapXPx == 0 ? 1 : 0, *std::ranges::min_element(g.rowHeightsPx) / 2);
    made.gamma = std::uniform_real_distribution<double>(1.6, 2.8)(random);
    if (random() % 2 == 0) made.black = std::uniform_real_distribution<double>(0, 0.01)(random);
    for (WallHost& host : made.wall.hosts) {
        TileOutput& out = host.tiles[0].output;
        out.blend = true;
        out.gamma = {made.gamma, made.gamma, made.gamma};
        out.black = made.black;
    }
    return made;
}

/// All projectors' light at each pixel of the screen, when every tile shows `value`; and by how much rounding to bytes
/// may change it.
struct ScreenLight {
    std::vector<double> light, slack;
};
ScreenLight lightOf(const BlendedWall& made, std::uint8_t value) {
    const ScreenPixels size = screenPixels(made.wall.screens[0]);
    ScreenLight sum;
    sum.light.resize(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
    sum.slack.resize(sum.light.size());
    for (const Tile& tile : layoutTiles(made.wall)) {
        auto maker = OutputMaker::make(made.wall, tile.name).value();
        const auto picture = even(tile.rect.width, tile.rect.height, value);
        const std::uint8_t* const start = picture.data();
        const std::uint8_t* const out = maker.draw({&start, 1});
        for (int y = 0; y < tile.rect.height; ++y) {
            for (int x = 0; x < tile.rect.width; ++x) {
                const std::size_t at = static_cast<std::size_t>(size.height - tile.rect.y - tile.rect.height + y) *
                                           static_cast<std::size_t>(size.width) +
                                       static_cast<std::size_t>(tile.rect.x + x);
                const double signal = channelAt(out, tile.rect.width, x, y, 1) / 255.0;
                sum.light[at] += made.black + (1 - made.black) * std::pow(signal, made.gamma);
                sum.slack[at] += std::pow(signal + 0.52 / 255, made.gamma) - std::pow(signal, made.gamma);
            }
        }
    }
    return sum;
}

TEST(Blend, LightOfAllTilesIsThatOfOnePicture) {
    for (unsigned seed = 0; seed < 150; ++seed) {
        std::mt19937 random(seed);
        const BlendedWall made = randomWall(random);
        ASSERT_FALSE(findWallFault(made.wall)) << findWallFault(made.wall)->message << again("Blend.Light*", seed);
        // The darkest that black can be made, and the same room for it everywhere.
        const BlackLift lift = blackLiftOf(made.wall, layoutTiles(made.wall)[0]);
        const double scale = 1 - lift.largestBlack - lift.most;
        double brightest = 0;
        const ScreenLight black = lightOf(made, 0);
        for (const double light : black.light) brightest = std::max(brightest, light);
        const int columns = made.wall.screens[0].grid.columns > 1 && made.wall.screens[0].grid.overlapXPx > 0 ? 2 : 1;
        const int rows = made.wall.screens[0].grid.rows > 1 && made.wall.screens[0].grid.overlapYPx > 0 ? 2 : 1;
        for (const int value : {0, 1, 60, 200, 255}) {
            const ScreenLight sum = lightOf(made, static_cast<std::uint8_t>(value));
            const double wanted = columns * rows * made.black + scale * std::pow(value / 255.0, 2.2);
            for (std::size_t i = 0; i < sum.light.size(); ++i)
                ASSERT_NEAR(sum.light[i], wanted, sum.slack[i] + 1e-4)
                    << again("Blend.Light*", seed) << " value " << value << " pixel " << i;
        }
    }
}

/// Without the rounding to bytes, and between pixels' centres too.
TEST(Blend, SharesAddUpToOne) {
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        const BlendedWall made = randomWall(random);
        const ScreenPixels size = screenPixels(made.wall.screens[0]);
        for (int i = 0; i < 200; ++i) {
            const double x = std::uniform_real_distribution<double>(0, size.width)(random),
                         y = std::uniform_real_distribution<double>(0, size.height)(random);
            double sum = 0;
            for (const Tile& tile : layoutTiles(made.wall)) {
                const double tx = x - tile.rect.x, ty = size.height - y - tile.rect.y;
                if (tx < 0 || ty < 0 || tx >= tile.rect.width || ty >= tile.rect.height) continue;
                sum += overlapsOf(made.wall.screens[0], tile.column, tile.row).shareAt(tx, tile.rect.height - ty);
            }
            ASSERT_NEAR(sum, 1, 1e-9) << again("Blend.Shares*", seed) << " at " << x << ' ' << y;
        }
    }
}

BlendPicture greyPicture(int width, int height, double value) {
    return {.widthPx = width,
            .heightPx = height,
            .values = std::vector<std::uint16_t>(static_cast<std::size_t>(width * height),
                                                 static_cast<std::uint16_t>(std::lround(65535 * value)))};
}

TEST(BlendPictures, ComeBackFromTheirFilesAndRefuseEverythingElse) {
    std::mt19937 random(5);
    BlendPicture picture = greyPicture(13, 7, 0);
    for (auto& value : picture.values) value = static_cast<std::uint16_t>(random());
    const Bytes file = encodeBlendPicture(picture);
    const auto back = decodeBlendPicture(file);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->values, picture.values);
    // Eight bits of three colours: a picture of another kind of PNG, and the same values.
    const auto rgb = decodeBlendPicture(encodePng(Picture::filled(3, 2, 9, 128, 200), std::nullopt));
    ASSERT_TRUE(rgb);
    EXPECT_EQ(rgb->values, std::vector<std::uint16_t>(6, 128 * 257));
    // All but the empty chunk at its end is wanted.
    for (std::size_t length = 0; length < file.size() - 12; ++length)
        EXPECT_FALSE(decodeBlendPicture(ByteSpan(file).first(length)));
    for (int i = 0; i < 3000; ++i) {
        Bytes damaged = file;
        for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<std::byte>(random());
        (void)decodeBlendPicture(damaged);
    }
}

TEST(BlendPictures, ThatAddUpToMoreThanOneProjectorsLightAreFound) {
    for (const double excess : {0.0, 0.01, 0.05, 0.5}) {
        for (const bool bent : {false, true}) {
            Wall wall = flatWall(2, 1, 64, 32, 16, 0);
            BlendPicture left = greyPicture(64, 32, 1);
            for (int y = 0; y < 32; ++y)
                for (int x = 0; x < 16; ++x)
                    left.values[static_cast<std::size_t>(y * 64 + 48 + x)] =
                        static_cast<std::uint16_t>(65535 * (15.5 - x) / 16);
            BlendPicture right = greyPicture(64, 32, 1);
            for (int y = 0; y < 32; ++y)
                for (int x = 0; x < 16; ++x)
                    right.values[static_cast<std::size_t>(y * 64 + x)] = static_cast<std::uint16_t>(std::min(
                        65535.0, 65535 * ((x + 0.5) / 16 + (x == 11 && y > 8 && y < 24 ? 16 : 0) * excess / 16)));
            wall.hosts[0].tiles[0].output.blendPicture = share(encodeBlendPicture(left));
            wall.hosts[1].tiles[0].output.blendPicture = share(encodeBlendPicture(right));
            if (bent) {
                for (WallHost& host : wall.hosts)
                    host.tiles[0].output.warp = std::make_shared<const WarpMesh>(straightMesh(3, 3));
            }
            const auto found = findBlendExcess(wall);
            // Squares of 16 pixels see a line of one pixel as a sixteenth of it.
            EXPECT_EQ(found.has_value(), excess > (bent ? 0.9 : 0.02))
                << excess << ' ' << bent << (found ? found->message : "");
            if (!found || bent) continue;
            EXPECT_EQ(found->host, 1u);
            EXPECT_WORDS(found->message);
        }
    }
}

/// Two projectors that each give all their light where they overlap, behind meshes that bend it.
TEST(BlendPictures, ThatAddUpToTwoBehindWarpsAreFound) {
    for (const double second : {0.0, 1.0}) {
        Wall wall = flatWall(2, 1, 128, 64, 48, 0);
        for (WallHost& host : wall.hosts) {
            WarpMesh mesh = straightMesh(5, 5);
            for (WarpNode& n : mesh.nodes) n.y *= 0.8f + 0.2f * n.x * n.x;
            host.tiles[0].output.warp = std::make_shared<const WarpMesh>(mesh);
        }
        wall.hosts[0].tiles[0].output.blendPicture = share(encodeBlendPicture(greyPicture(128, 64, 1)));
        wall.hosts[1].tiles[0].output.blendPicture = share(encodeBlendPicture(greyPicture(128, 64, second)));
        const auto found = findBlendExcess(wall);
        ASSERT_EQ(found.has_value(), second > 0);
        if (found) {
            EXPECT_WORDS(found->message);
        }
    }
}

}  // namespace
}  // namespace tessera::test
