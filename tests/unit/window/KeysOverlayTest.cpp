/// The words that F1 lays over a window.
#include "client/window/KeysOverlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

TEST(AskedManner, IsWhatTheWindowHasAskedFor) {
    AskedManner manner;
    InputState state;
    EXPECT_FALSE(manner.take(state));
    EXPECT_EQ(manner.mode(), NavigationMode::kFly);
    EXPECT_EQ(manner.pace(), 1);
    state.wheel += 2 * InputState::kUnit;
    EXPECT_TRUE(manner.take(state));
    EXPECT_DOUBLE_EQ(manner.pace(), 1.5625);
    state.ask(InputAction::kNextMode);
    EXPECT_TRUE(manner.take(state));
    EXPECT_EQ(manner.mode(), NavigationMode::kOrbit);
    state.wheel += InputState::kUnit;
    EXPECT_FALSE(manner.take(state)) << "nearer, not faster";
    EXPECT_DOUBLE_EQ(manner.pace(), 1.5625);
    state.ask(InputAction::kWalk);
    EXPECT_TRUE(manner.take(state));
    EXPECT_EQ(manner.mode(), NavigationMode::kWalk);
    state.ask(InputAction::kNextMode);
    state.wheel -= 4 * InputState::kUnit;
    EXPECT_TRUE(manner.take(state));
    EXPECT_EQ(manner.mode(), NavigationMode::kFly);
    EXPECT_DOUBLE_EQ(manner.pace(), 0.64);
    state.wheel += 100 * InputState::kUnit;
    EXPECT_TRUE(manner.take(state));
    state.wheel -= InputState::kUnit;
    EXPECT_TRUE(manner.take(state));
    EXPECT_DOUBLE_EQ(manner.pace(), 4096 / 1.25) << "clicks beyond the fastest are not kept for the way back";
}

TEST(KeysOverlay, FitsItsWindow) {
    for (const auto& [width, height] : {std::pair(960, 540), {320, 180}, {3840, 2160}, {100, 40}, {1, 1}}) {
        const Picture picture = keysOverlay(AskedManner(), width, height);
        EXPECT_LE(picture.widthPx, width);
        EXPECT_LE(picture.heightPx, height);
    }
    const Picture picture = keysOverlay(AskedManner(), 960, 540);
    EXPECT_GT(picture.widthPx, 300);
    const auto bright = std::count_if(picture.rgb.begin(), picture.rgb.end(), [](std::uint8_t c) { return c > 200; });
    EXPECT_GT(bright, 3000) << "letters";
    InputState walks;
    walks.ask(InputAction::kWalk);
    AskedManner manner;
    manner.take(walks);
    EXPECT_FALSE(keysOverlay(manner, 960, 540) == picture) << "the mode is told";
}

}  // namespace
}  // namespace tessera
