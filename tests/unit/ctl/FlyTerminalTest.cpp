// A terminal's keys as input: presses hold for a moment, sequences are arrows, and ends are ends.
#include "client/ctl/FlyTerminal.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

using namespace std::chrono_literals;
using FlightClock = TerminalKeys::Clock;

TEST(FlyTerminal, APressHoldsAMomentAndItsRepeatsHoldOn) {
    TerminalKeys keys;
    const FlightClock::time_point begin{};
    keys.feed("w", begin + 1s);
    EXPECT_EQ(keys.at(begin + 1s).back, -InputState::kFull);
    EXPECT_EQ(keys.at(begin + 1s + TerminalKeys::kHold).back, 0);
    for (int i = 0; i < 20; ++i) keys.feed("w", begin + 2s + i * 100ms);
    EXPECT_EQ(keys.at(begin + 4s).back, -InputState::kFull);
    keys.feed("s", begin + 4s);
    EXPECT_EQ(keys.at(begin + 4s).back, InputState::kFull) << "the last one counts";
    keys.feed("D", begin + 4s);
    EXPECT_EQ(keys.at(begin + 4s).held, InputState::kFaster);
    EXPECT_EQ(keys.at(begin + 4s).right, InputState::kFull);
    keys.feed(" ", begin + 4s);
    EXPECT_TRUE(keys.at(begin + 4s).atRest());
}

TEST(FlyTerminal, ArrowsLookAndNumbersAreBookmarks) {
    TerminalKeys keys;
    const FlightClock::time_point now = FlightClock::time_point{} + 1s;
    keys.feed("\x1b[A\x1b[C", now);
    EXPECT_EQ(keys.at(now).turnUp, InputState::kFull);
    EXPECT_EQ(keys.at(now).turnRight, InputState::kFull);
    keys.feed("\x1b[1;2D\x1bOB", now);
    EXPECT_EQ(keys.at(now).turnRight, -InputState::kFull);
    EXPECT_EQ(keys.at(now).turnUp, -InputState::kFull);
    keys.feed("5k7\x1b[H\x1b[1~\x7f\tf++-", now);
    const InputState& state = keys.at(now);
    EXPECT_EQ(state.asked[static_cast<std::size_t>(InputAction::kGoTo1) + 4], 1);
    EXPECT_EQ(state.asked[static_cast<std::size_t>(InputAction::kKeep1) + 6], 1);
    EXPECT_EQ(state.asked[static_cast<std::size_t>(InputAction::kHome)], 3);
    EXPECT_EQ(state.asked[static_cast<std::size_t>(InputAction::kNextMode)], 1);
    EXPECT_EQ(state.asked[static_cast<std::size_t>(InputAction::kFitAll)], 1);
    EXPECT_EQ(state.wheel, static_cast<std::uint64_t>(InputState::kUnit));
    EXPECT_FALSE(keys.over());
}

TEST(FlyTerminal, EndsWhereOneIsMeant) {
    for (const std::string_view end : {"x", "\x1b", "\x03", "\x04", "ww\x1b", "\x1bx"}) {
        TerminalKeys keys;
        keys.feed(end, FlightClock::time_point{} + 1s);
        EXPECT_TRUE(keys.over());
    }
}

TEST(FlyTerminal, AnyBytesAreSomeInput) {
    std::mt19937 random(5);
    TerminalKeys keys;
    FlightClock::time_point now{};
    for (int i = 0; i < 20'000; ++i) {
        std::string bytes(random() % 8, '\0');
        for (char& c : bytes) c = static_cast<char>(random());
        keys.feed(bytes, now += 10ms);
        const InputState& state = keys.at(now);
        for (const std::int16_t axis : {state.right, state.up, state.back, state.turnRight, state.turnUp, state.rollRight})
            ASSERT_TRUE(axis == 0 || axis == InputState::kFull || axis == -InputState::kFull);
    }
}

}  // namespace
}  // namespace tessera
