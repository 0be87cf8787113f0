/// Flying with a terminal: keys to input, for who sits at no window of the wall.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "client/ctl/Answer.h"
#include "common/application/Application.h"
#include "common/input/HandInput.h"

namespace tessera {

/// A terminal says that a key was pressed and never that it was let go: each press holds for a moment, and the repeats
/// of a key that stays down hold on. Times are the caller's.
class TerminalKeys {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds kHold{300};
    static constexpr std::int64_t kHandStep =
        InputState::kUnit / 50;  ///< of an arrow, while the hand holds something: a part of the wall's height
    static constexpr std::chrono::milliseconds kLoneEscape{
        150};  ///< an Escape with nothing behind it for so long is one

    /// What the terminal has sent, however it was cut on its way: the begin of a sequence waits for its rest. A lone
    /// Escape, x, Ctrl+C and Ctrl+D end it.
    void feed(std::string_view bytes, Clock::time_point now);
    /// As it is at `now`, up to which all that had come has been fed.
    [[nodiscard]] const InputState& at(Clock::time_point now);
    [[nodiscard]] bool over() const { return over_; }

    [[nodiscard]] static std::string_view help();

private:
    /// One of six axes, in a direction.
    void hold(std::int16_t InputState::*axis, int direction, bool faster, Clock::time_point now);
    void key(char c, Clock::time_point now);
    void sequence(char last, Clock::time_point now);
    void take(char c, Clock::time_point now);
    /// Arrows, while the hand holds something: a step of it.
    void leadHand(int right, int down);

    enum class Place : std::uint8_t { kBetween, kBehindEscape, kInSequence };
    struct Held {
        std::int16_t InputState::*axis;
        int direction = 0;
        Clock::time_point until{};
    };
    std::array<Held, 6> held_{{{&InputState::right},
                               {&InputState::up},
                               {&InputState::back},
                               {&InputState::turnRight},
                               {&InputState::turnUp},
                               {&InputState::rollRight}}};
    Clock::time_point fasterUntil_{}, escapeAt_{};
    Place place_ = Place::kBetween;
    std::string parameters_;  ///< of the sequence so far; no more than any that counts has
    InputState state_;
    bool keeps_ = false, over_ = false;
    bool hand_ = false;  ///< it has taken hold in the middle of the wall
};

/// Until a key ends it, or the server does. kUsage: no terminal here.
[[nodiscard]] Expected<Answer> flyByTerminal(Application& application, const Print& print);

}  // namespace tessera
