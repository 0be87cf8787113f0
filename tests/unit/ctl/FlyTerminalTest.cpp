// A terminal's keys as input: presses hold for a moment, sequences are arrows, and ends are ends.
#include "client/ctl/FlyTerminal.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <random>
#include <string>

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

TEST(FlyTerminal, ArrowsLeadWhatTheHandHolds) {
    TerminalKeys keys;
    const FlightClock::time_point now = FlightClock::time_point{} + 1s;
    const auto way = [](std::uint64_t sum) { return static_cast<std::int64_t>(sum); };
    keys.feed("g\x1b[C\x1b[C\x1b[A", now);
    EXPECT_EQ(keys.at(now).asked[kHandTakes], 1);
    EXPECT_EQ(keys.at(now).asked[static_cast<std::size_t>(InputAction::kGrab)], 1);
    EXPECT_EQ(keys.at(now).held & kHandHolds, kHandHolds);
    EXPECT_EQ(keys.at(now).cursorX, 32768) << "in the middle";
    EXPECT_EQ(way(keys.at(now).lookRight), 2 * TerminalKeys::kHandStep);
    EXPECT_EQ(way(keys.at(now).lookDown), -TerminalKeys::kHandStep);
    EXPECT_TRUE(keys.at(now).atRest()) << "the view does not turn";
    EXPECT_EQ(keys.at(now + 10s).held & kHandHolds, kHandHolds) << "it holds on";
    keys.feed("g\x1b[C", now);
    EXPECT_EQ(keys.at(now).held & kHandHolds, 0u);
    EXPECT_EQ(keys.at(now).turnRight, InputState::kFull);
    EXPECT_EQ(way(keys.at(now).lookRight), 2 * TerminalKeys::kHandStep);
    keys.feed("g ", now);
    EXPECT_EQ(keys.at(now).asked[kHandTakes], 2);
    EXPECT_EQ(keys.at(now).held & kHandHolds, 0u) << "Space lets go of everything";
}

TEST(FlyTerminal, EndsWhereOneIsMeant) {
    const FlightClock::time_point now = FlightClock::time_point{} + 1s;
    for (const std::string_view end : {"x", "\x03", "\x04", "\x1bx", "\x1b\x1b", "\x1b[\x03", "\x1b[x\x1b[Ax"}) {
        TerminalKeys keys;
        keys.feed(end, now);
        EXPECT_TRUE(keys.over()) << end.substr(1);
    }
    // A lone Escape is one when nothing has come behind it for a moment.
    for (const std::string_view end : {"\x1b", "ww\x1b", "\x1b[A\x1b"}) {
        TerminalKeys keys;
        keys.feed(end, now);
        (void)keys.at(now + TerminalKeys::kLoneEscape - 1ms);
        EXPECT_FALSE(keys.over());
        (void)keys.at(now + TerminalKeys::kLoneEscape);
        EXPECT_TRUE(keys.over());
    }
}

/// Arrows, Home and the like mean the same however reads and the network cut them.
TEST(FlyTerminal, WhatIsCutMeansWhatItMeansWhole) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                    << " build/bin/unit_ctl --gtest_filter=FlyTerminal.WhatIsCut*");
    std::mt19937 random(seed);
    const std::array<std::string_view, 12> parts = {
        "\x1b[A",       "\x1b[B", "\x1b[C",  "\x1b[D", "\x1bOA", "\x1b[1;2D",
        "\x1b[12;345~", "\x1b[H", "\x1b[1~", "w",      "D",      "+"};
    for (int round = 0; round < 2000; ++round) {
        std::string typed;
        for (std::size_t count = 1 + random() % 100; count > 0; --count) typed += parts[random() % parts.size()];
        const FlightClock::time_point begun = FlightClock::time_point{} + 1s;
        TerminalKeys whole, cut;
        whole.feed(typed, begun);
        FlightClock::time_point now = begun;
        const std::size_t longest = round % 3 == 0 ? 1 : round % 3 == 1 ? 256 : 1 + random() % 5;
        for (std::size_t i = 0; i < typed.size(); i += longest) {
            cut.feed(std::string_view(typed).substr(i, longest), now);
            // Looked at between, where packets are far apart.
            if (round % 2 == 0) (void)cut.at(now + TerminalKeys::kLoneEscape - 1ms);
            if (round % 4 == 0) now += TerminalKeys::kLoneEscape - 1ms;
        }
        ASSERT_FALSE(whole.over() || cut.over()) << round;
        const InputState &one = whole.at(begun), &other = cut.at(now);
        ASSERT_EQ(one.asked, other.asked);
        ASSERT_EQ(one.wheel, other.wheel);
        if (now != begun) continue;
        ASSERT_TRUE(one == other) << round;
    }
}

TEST(FlyTerminal, AnyBytesAreSomeInput) {
    std::mt19937 random(5);
    TerminalKeys keys;
    FlightClock::time_point now{};
    for (int i = 0; i < 20'000; ++i) {
        if (keys.over()) keys = {};
        std::string bytes(random() % 8, '\0');
        for (char& c : bytes) c = static_cast<char>(random());
        keys.feed(bytes, now += 10ms);
        const InputState& state = keys.at(now);
        for (const std::int16_t axis :
             {state.right, state.up, state.back, state.turnRight, state.turnUp, state.rollRight})
            ASSERT_TRUE(axis == 0 || axis == InputState::kFull || axis == -InputState::kFull);
    }
}

}  // namespace
}  // namespace tessera
