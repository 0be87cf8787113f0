/// Letters that can be told apart, and stay where they belong.
#include "client/testpicture/StrokeFont.h"

#include <gtest/gtest.h>

#include "client/testpicture/ScreenCanvas.h"

namespace tessera {
namespace {

constexpr std::string_view kAllLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-+_.,:/()=%'";

Picture drawnSmall(char letter, int heightPx) {
    ScreenCanvas canvas(0, 0, heightPx + 4, heightPx + 4);
    canvas.text(1, 1, heightPx, std::string(1, letter), {255, 255, 255});
    return std::move(canvas).take();
}

TEST(StrokeFont, LettersDifferEvenAtSevenPixels) {
    for (std::size_t i = 0; i < kAllLetters.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            EXPECT_FALSE(drawnSmall(kAllLetters[i], 7) == drawnSmall(kAllLetters[j], 7))
                << kAllLetters[i] << " and " << kAllLetters[j];
}

TEST(StrokeFont, DotsAreSeenWhereverTheyFall) {
    for (double x = 0; x < 2; x += 0.13)
        for (double y = 0; y < 2; y += 0.13) {
            ScreenCanvas canvas(0, 0, 16, 16);
            canvas.text(x, y, 5, ".", {255, 255, 255});
            EXPECT_FALSE(std::move(canvas).take() == Picture::filled(16, 16, 0, 0, 0)) << x << " " << y;
        }
}

TEST(StrokeFont, KeepsToItsLineAndItsWidth) {
    for (const std::string text : {"A", "Hello, wall 3", "front-0-1", "g(%)", "Größe"}) {
        const double width = widthOfText(text);
        for (const Stroke& s : strokesOf(text)) {
            for (const double x : {s.x0, s.x1}) EXPECT_TRUE(x >= 0 && x <= width + 1e-12) << text << " " << x;
            for (const double y : {s.y0, s.y1}) EXPECT_TRUE(y >= 0 && y <= 7.0 / 6 + 1e-12) << text << " " << y;
        }
    }
    EXPECT_EQ(widthOfText(""), 0);
    EXPECT_GT(widthOfText("AA"), 2 * widthOfText("A"));
}

TEST(StrokeFont, DrawsABoxForWhatItDoesNotKnow) {
    EXPECT_EQ(strokesOf("~").size(), 4u);
    EXPECT_EQ(strokesOf("ü").size(), 8u) << "two bytes";
    EXPECT_TRUE(strokesOf("  ").empty());
}

}  // namespace
}  // namespace tessera
