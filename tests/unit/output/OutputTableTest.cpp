/// One tile's picture through mesh, share of light and colour, beside the formulas in double precision.
#include "client/output/OutputTable.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/output/OutputScenes.h"

namespace tessera::test {
namespace {

std::vector<std::uint8_t> drawn(const OutputTable& table, const std::vector<std::uint8_t>& from, int widthPx,
                                int heightPx) {
    std::vector<std::uint8_t> to = even(widthPx, heightPx, 77);
    table.draw(from.data(), {to.data(), 4 * static_cast<std::size_t>(widthPx)});
    return to;
}

int sideBelow(std::mt19937& random, int most) {
    return std::uniform_int_distribution<int>(1, most)(random);
}

TEST(OutputTable, AMeshThatChangesNothingLeavesEveryByte) {
    for (unsigned seed = 0; seed < 120; ++seed) {
        std::mt19937 random(seed);
        const int width = sideBelow(random, 300), height = sideBelow(random, 200);
        const WarpMesh mesh = straightMesh(1 + sideBelow(random, 40), 1 + sideBelow(random, 40));
        const auto picture = noise(random, width, height);
        const OutputTable table(
            {.fromWidthPx = width, .fromHeightPx = height, .widthPx = width, .heightPx = height, .warp = &mesh});
        auto out = drawn(table, picture, width, height);
        for (std::size_t i = 0; i < out.size(); ++i)
            if (i % 4 != 3) {
                ASSERT_EQ(out[i], picture[i]) << again("OutputTable.AMesh*", seed) << " byte " << i;
            }
    }
}

/// A straight mesh whose inner nodes are moved by up to a third of a face, in the output and in the picture.
WarpMesh bentMesh(std::mt19937& random) {
    WarpMesh mesh = straightMesh(2 + sideBelow(random, 9), 2 + sideBelow(random, 9));
    std::uniform_real_distribution<float> shift(-0.3f, 0.3f), light(0.0f, 1.0f);
    for (int row = 0; row < mesh.rows; ++row) {
        for (int column = 0; column < mesh.columns; ++column) {
            WarpNode& n = mesh.nodes[static_cast<std::size_t>(row * mesh.columns + column)];
            const float across = 1.0f / static_cast<float>(mesh.columns - 1),
                        down = 1.0f / static_cast<float>(mesh.rows - 1);
            n.x += 2 * across * shift(random) * 0.7f;
            n.y += 2 * down * shift(random) * 0.7f;
            n.u += across * shift(random) * 0.7f;
            n.v += down * shift(random) * 0.7f;
            n.intensity = light(random);
        }
    }
    return mesh;
}

/// The picture at a place in pixels, bilinear between centres, the last ones going on to the edge.
double pictureAt(const std::vector<std::uint8_t>& picture, int width, int height, double x, double y, std::size_t c) {
    x = std::clamp(x - 0.5, 0.0, width - 1.0);
    y = std::clamp(y - 0.5, 0.0, height - 1.0);
    const int x0 = std::min(static_cast<int>(x), width - 1), y0 = std::min(static_cast<int>(y), height - 1);
    const int x1 = std::min(x0 + 1, width - 1), y1 = std::min(y0 + 1, height - 1);
    const double fx = x - x0, fy = y - y0;
    const auto at = [&](int px, int py) { return static_cast<double>(channelAt(picture.data(), width, px, py, c)); };
    return (1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x1, y0)) + fy * ((1 - fx) * at(x0, y1) + fx * at(x1, y1));
}

/// The oracle goes the other way: from places inside of a face to the output, by sampling faces densely. A place that
/// lands near a pixel's middle is moved along the face until it lies there.
TEST(OutputTable, ABentMeshShowsWhatItsFacesSay) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        std::mt19937 random(seed);
        const int width = 20 + sideBelow(random, 60), height = 20 + sideBelow(random, 60),
                  outW = 20 + sideBelow(random, 80), outH = 20 + sideBelow(random, 80);
        WarpMesh mesh = bentMesh(random);
        if (findWarpFault(mesh)) continue;
        for (WarpNode& n : mesh.nodes) n.intensity = 1;
        // Smooth in the picture: then a place that is a little off has a value that is a little off.
        std::vector<std::uint8_t> picture = even(width, height, 0);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (std::size_t c = 0; c < 3; ++c)
                    picture[4 * static_cast<std::size_t>(y * width + x) + c] = static_cast<std::uint8_t>(
                        127 + 120 * std::sin(0.05 * x * static_cast<double>(c + 1) + 0.04 * y));
        const OutputTable table(
            {.fromWidthPx = width, .fromHeightPx = height, .widthPx = outW, .heightPx = outH, .warp = &mesh});
        const auto out = drawn(table, picture, outW, outH);
        int compared = 0;
        for (int i = 0; i < 20'000; ++i) {
            std::uniform_real_distribution<double> unit(0, 1);
            const int column = std::uniform_int_distribution<int>(0, mesh.columns - 2)(random),
                      row = std::uniform_int_distribution<int>(0, mesh.rows - 2)(random);
            double s = unit(random), t = unit(random);
            // A centre beside the mesh's own edge may lie beyond it.
            const bool edge = (column == 0 && s < 0.1) || (row == 0 && t < 0.1) ||
                              (column == mesh.columns - 2 && s > 0.9) || (row == mesh.rows - 2 && t > 0.9);
            if (edge) continue;
            const auto mix = [&](float WarpNode::*part) {
                return (1 - s) * (1 - t) * mesh.at(column, row).*part + s * (1 - t) * mesh.at(column + 1, row).*part +
                       s * t * mesh.at(column + 1, row + 1).*part + (1 - s) * t * mesh.at(column, row + 1).*part;
            };
            const auto place = [&] {
                return Vec2d(0.5 * (mix(&WarpNode::x) + 1) * outW - 0.5, 0.5 * (1 - mix(&WarpNode::y)) * outH - 0.5);
            };
            const Vec2d near = place();
            const int px = static_cast<int>(std::lround(near.x())), py = static_cast<int>(std::lround(near.y()));
            if (px < 0 || py < 0 || px >= outW || py >= outH || (Vec2d(px, py) - near).cwiseAbs().maxCoeff() > 0.05)
                continue;
            for (int step = 0; step < 4; ++step) {
                const Vec2d at = place();
                s += 1e-4;
                const Vec2d alongS = (place() - at) / 1e-4;
                s -= 1e-4, t += 1e-4;
                const Vec2d alongT = (place() - at) / 1e-4;
                t -= 1e-4;
                Eigen::Matrix2d turn;
                turn << alongS, alongT;
                const Vec2d more = turn.inverse() * (Vec2d(px, py) - at);
                s += more.x(), t += more.y();
            }
            if (s < 0 || t < 0 || s > 1 || t > 1) continue;  // in the neighbour's face
            const double u = mix(&WarpNode::u), v = 1 - mix(&WarpNode::v);
            if (u < 0.01 || v < 0.01 || u > 0.99 || v > 0.99) continue;
            for (std::size_t c = 0; c < 3; ++c)
                ASSERT_NEAR(channelAt(out.data(), outW, px, py, c),
                            pictureAt(picture, width, height, u * width, v * height, c), 1.0)
                    << again("OutputTable.ABent*", seed) << " pixel " << px << ' ' << py;
            ++compared;
        }
        EXPECT_GT(compared, 20);
    }
}

TEST(OutputTable, WhatLiesOutsideOfThePictureOrOfTheMeshIsBlack) {
    WarpMesh mesh = straightMesh(2, 2);
    for (WarpNode& n : mesh.nodes) n.x *= 0.5f;           // the middle half of the output
    for (WarpNode& n : mesh.nodes) n.v = 2 * n.v - 0.5f;  // a quarter of its height beyond the picture on either side
    const auto picture = even(40, 40, 200);
    const OutputTable table({.fromWidthPx = 40, .fromHeightPx = 40, .widthPx = 40, .heightPx = 40, .warp = &mesh});
    const auto out = drawn(table, picture, 40, 40);
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x)
            EXPECT_EQ(channelAt(out.data(), 40, x, y, 1), x >= 10 && x < 30 && y >= 10 && y < 30 ? 200 : 0)
                << x << ' ' << y;
}

TEST(OutputTable, FlipsTurnTheFinishedPictureRound) {
    std::mt19937 random(3);
    const auto picture = noise(random, 7, 5);
    for (const bool flipX : {false, true}) {
        for (const bool flipY : {false, true}) {
            const OutputTable table(
                {.fromWidthPx = 7, .fromHeightPx = 5, .widthPx = 7, .heightPx = 5, .flipX = flipX, .flipY = flipY});
            const auto out = drawn(table, picture, 7, 5);
            for (int y = 0; y < 5; ++y)
                for (int x = 0; x < 7; ++x)
                    EXPECT_EQ(channelAt(out.data(), 7, x, y, 0),
                              channelAt(picture.data(), 7, flipX ? 6 - x : x, flipY ? 4 - y : y, 0));
        }
    }
}

/// signal = (share · gain · c^2.2)^(1/gamma), to a rounding of what goes out.
TEST(OutputTable, ColoursAndSharesFollowTheirFormula) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        const double share = unit(random);
        const ChannelValues gain{unit(random), 1.5 * unit(random), 1}, gamma{0.8 + 2 * unit(random), 2.2, 2.4};
        std::vector<std::uint8_t> picture = even(256, 1, 0);
        for (int x = 0; x < 256; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                picture[4 * static_cast<std::size_t>(x) + c] = static_cast<std::uint8_t>(x);
        const OutputTable table({.fromWidthPx = 256,
                                 .fromHeightPx = 1,
                                 .widthPx = 256,
                                 .heightPx = 1,
                                 .share = [&](double, double, double, double) { return share; },
                                 .gain = gain,
                                 .gamma = gamma});
        const auto out = drawn(table, picture, 256, 1);
        for (int x = 0; x < 256; ++x)
            for (std::size_t c = 0; c < 3; ++c) {
                const double light = std::min(1.0, gain[c] * std::pow(x / 255.0, 2.2));
                ASSERT_NEAR(channelAt(out.data(), 256, x, 0, c), 255 * std::pow(share * light, 1 / gamma[c]), 0.52)
                    << again("OutputTable.Colours*", seed) << " value " << x << " channel " << c;
            }
    }
}

TEST(OutputTable, OfAnOutputThatIsBlendedAtItsEdgesIsATableOfItsEdges) {
    const OutputTable table({.fromWidthPx = 1000,
                             .fromHeightPx = 500,
                             .widthPx = 1000,
                             .heightPx = 500,
                             .share = [](double x, double, double, double) { return x < 100 ? x / 100 : 1; }});
    EXPECT_LT(table.size(), std::size_t{16} * 110 * 500);
}

}  // namespace
}  // namespace tessera::test
