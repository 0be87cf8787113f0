// States of windows and terminals, added up: whatever is lost, repeated or late.
#include <gtest/gtest.h>

#include <chrono>

#include "server/sim/navigation/InputSources.h"

namespace tessera {
namespace {

const InputSources::PlaceOf kNowhere = [](const std::string&, std::uint32_t, double,
                                          double) -> std::optional<InputSources::Place> { return std::nullopt; };

InputState forward(std::uint32_t source = 0) {
    return {.source = source, .back = -InputState::kFull};
}

TEST(InputSources, SourcesAddUpAndAreReleasedWithTheirHost) {
    InputSources sources;
    sources.take("left", forward());
    sources.take("left", forward(1));
    sources.take("right", {.right = InputState::kFull, .turnUp = InputState::kFull});
    const NavigationInput both = sources.frame({}, kNowhere);
    EXPECT_EQ(both.move, Vec3d(1, 0, -2));
    EXPECT_EQ(both.turn, Vec2d(0, 1));
    EXPECT_EQ(sources.frame({}, kNowhere).move, both.move) << "held until it is let go";
    EXPECT_EQ(sources.active(), (std::vector<std::string>{"left", "right"}));
    sources.end("left");
    EXPECT_EQ(sources.frame({}, kNowhere).move, Vec3d(1, 0, 0));
    sources.end("right");
    EXPECT_FALSE(sources.frame({}, kNowhere).steers());
    EXPECT_TRUE(sources.empty());
}

TEST(InputSources, SumsAndCountsSurviveWhatIsLostAndWrapAround) {
    for (const std::uint64_t start : {std::uint64_t{0}, ~std::uint64_t{0} - 70'000}) {
        InputSources sources;
        InputState state{.lookRight = start, .wheel = start};
        state.asked.fill(65534);
        sources.take("host", state);
        EXPECT_FALSE(sources.frame({}, kNowhere).steers()) << "the first says where it begins";
        for (int i = 0; i < 4; ++i) {
            state.lookRight += InputState::kUnit / 2;
            state.wheel += InputState::kUnit;
            state.ask(InputAction::kHome);
            if (i % 2 == 1) sources.take("host", state);  // every other one is lost
        }
        sources.take("host", state);
        const NavigationInput input = sources.frame({}, kNowhere);
        EXPECT_EQ(input.look.x(), 2);
        EXPECT_EQ(input.wheel, 4);
        EXPECT_EQ(input.actions, std::vector(4, InputAction::kHome));
        EXPECT_FALSE(sources.frame({}, kNowhere).steers()) << "had once";
    }
}

// Frames of 500 ms: what counts is how long, wherever in them it begins and ends.
TEST(InputSources, WhatIsHeldCountsAsLongAsItIsHeld) {
    using std::chrono::milliseconds;
    const TimePoint start{std::chrono::hours(1)};
    for (const int begin : {1, 100, 499, 500, 501, 730}) {
        for (const int length : {0, 1, 20, 100, 300, 1000, 1700}) {
            InputSources sources;
            sources.take("host", {}, start);
            bool down = false, up = false;
            double metres = 0;
            (void)sources.frame(start, kNowhere);
            for (int frame = 1; frame <= 8; ++frame) {
                if (!down && begin <= 500 * frame)
                    down = true, sources.take("host", forward(), start + milliseconds(begin));
                if (down && !up && begin + length <= 500 * frame)
                    up = true, sources.take("host", {}, start + milliseconds(begin + length));
                metres -= 0.5 * sources.frame(start + milliseconds(500 * frame), kNowhere).move.z();
            }
            EXPECT_NEAR(metres, 0.001 * length, 1e-9) << "from " << begin << " ms";
            EXPECT_FALSE(sources.frame(start + milliseconds(5000), kNowhere).steers());
        }
    }
    // A host that comes in the middle of a frame holds nothing before; times that run backwards are none.
    InputSources sources;
    (void)sources.frame(start, kNowhere);
    sources.take("late", forward(), start + milliseconds(400));
    EXPECT_NEAR(sources.frame(start + milliseconds(500), kNowhere).move.z(), -0.2, 1e-9);
    sources.take("late", {}, start);
    EXPECT_EQ(sources.frame(start + milliseconds(1000), kNowhere).move.z(), 0);
}

TEST(InputSources, NobodyDoesMoreThanHandsCan) {
    InputSources sources;
    for (std::uint32_t i = 0; i < 1000; ++i) sources.take("host", forward(i));
    EXPECT_EQ(sources.frame({}, kNowhere).move.z(), -static_cast<double>(InputSources::kMaxSourcesEach));
    InputState state;
    sources.take("other", state);
    state.lookRight = 1ull << 62;
    state.wheel = 1ull << 63;
    state.right = -32768;
    state.asked.fill(60'000);
    sources.take("other", state);
    const NavigationInput input = sources.frame({}, kNowhere);
    EXPECT_LE(std::abs(input.look.x()), 16);
    EXPECT_LE(std::abs(input.wheel), 16);
    EXPECT_EQ(input.move.x(), -1);
    EXPECT_LE(input.actions.size(), kInputActions * InputSources::kMaxAskedAtOnce);
    for (const InputAction action : input.actions) EXPECT_LT(static_cast<std::size_t>(action), kInputActions);
}

TEST(InputSources, AGrabPointsFromItsWindow) {
    InputSources sources;
    InputState state{.source = 3};
    sources.take("host", state);
    state.ask(InputAction::kGrab);
    state.cursorX = 65535;
    state.cursorY = 0;
    state.panRight = InputState::kUnit;
    sources.take("host", state);
    const NavigationInput input =
        sources.frame({}, [](const std::string& who, std::uint32_t source, double x, double y) {
            EXPECT_EQ(who, "host");
            EXPECT_EQ(source, 3u);
            return InputSources::Place{.ray = {Vec3d(x, y, 0), Vec3d::UnitZ()}, .height = 0.5};
        });
    ASSERT_TRUE(input.pointing);
    EXPECT_EQ(input.pointing->origin, Vec3d(1, 0, 0));
    EXPECT_EQ(input.pan.x(), 0.5);
}

}  // namespace
}  // namespace tessera
