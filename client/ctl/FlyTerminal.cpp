#include "client/ctl/FlyTerminal.h"

#include "client/ctl/RawTerminal.h"

namespace tessera {
namespace {

constexpr std::chrono::milliseconds kTick(20);

}  // namespace

std::string_view TerminalKeys::help() {
    return "w a s d  go and step aside     q e  down, up     capitals: faster     + -  the pace; orbit: nearer, "
           "farther\n"
           "arrows   look; orbit: around   z c  roll         l  upright           Tab  fly, orbit, walk\n"
           "f  fit all   Backspace, Home  the first view   1 … 9  to a bookmark, k 1 … 9 keeps one\n"
           "g  takes hold of the manipulator's handle in the middle of the wall: arrows lead it, g or Space lets go\n"
           "Space  stop   ?  these keys   x, Escape  end\n";
}

void TerminalKeys::hold(std::int16_t InputState::*axis, int direction, bool faster, Clock::time_point now) {
    for (Held& held : held_)
        if (held.axis == axis) {
            held.direction = direction;
            held.until = now + kHold;
        }
    fasterUntil_ = faster ? now + kHold : Clock::time_point{};
}

void TerminalKeys::key(char c, Clock::time_point now) {
    const bool capital = c >= 'A' && c <= 'Z';
    const char small = capital ? static_cast<char>(c - 'A' + 'a') : c;
    if (c >= '1' && c <= '9') {
        state_.ask(keeps_ ? InputAction::kKeep1 : InputAction::kGoTo1, static_cast<std::size_t>(c - '1'));
        keeps_ = false;
        return;
    }
    keeps_ = small == 'k';
    switch (small) {
        case 'd':
        case 'a':
            return hold(&InputState::right, small == 'd' ? 1 : -1, capital, now);
        case 'e':
        case 'q':
            return hold(&InputState::up, small == 'e' ? 1 : -1, capital, now);
        case 's':
        case 'w':
            return hold(&InputState::back, small == 's' ? 1 : -1, capital, now);
        case 'c':
        case 'z':
            return hold(&InputState::rollRight, small == 'c' ? 1 : -1, capital, now);
        case '+':
        case '-':
            state_.wheel += static_cast<std::uint64_t>(c == '+' ? InputState::kUnit : -InputState::kUnit);
            return;
        case 'f':
            return state_.ask(InputAction::kFitAll);
        case 'l':
            return state_.ask(InputAction::kLevel);
        case '\t':
            return state_.ask(InputAction::kNextMode);
        case '\b':
        case 127:
            return state_.ask(InputAction::kHome);
        case 'g':
            hand_ = !hand_;
            if (!hand_) return;
            ++state_.asked[kHandTakes];
            return state_.ask(InputAction::kGrab);
        case ' ':
            hand_ = false;
            for (Held& held : held_) held.until = {};
            return;
        case 'x':
        case 3:
        case 4:
            over_ = true;
            return;
        default:
            return;
    }
}

/// The last letter of what arrows and the like send behind Escape and a bracket.
void TerminalKeys::sequence(char last, Clock::time_point now) {
    if (hand_ && last >= 'A' && last <= 'D')
        return leadHand(last == 'C' ? 1 : last == 'D' ? -1 : 0, last == 'B' ? 1 : last == 'A' ? -1 : 0);
    switch (last) {
        case 'A':
        case 'B':
            return hold(&InputState::turnUp, last == 'A' ? 1 : -1, false, now);
        case 'C':
        case 'D':
            return hold(&InputState::turnRight, last == 'C' ? 1 : -1, false, now);
        case 'H':
            return state_.ask(InputAction::kHome);
        default:
            return;
    }
}

void TerminalKeys::leadHand(int right, int down) {
    state_.lookRight += static_cast<std::uint64_t>(right * kHandStep);
    state_.lookDown += static_cast<std::uint64_t>(down * kHandStep);
}

void TerminalKeys::take(char c, Clock::time_point now) {
    if (c == '\x1b') {
        // Behind another it makes that one a key of its own; within a sequence it begins the next.
        if (place_ == Place::kBehindEscape) over_ = true;
        place_ = Place::kBehindEscape;
        escapeAt_ = now;
        return;
    }
    switch (place_) {
        case Place::kBetween:
            return key(c, now);
        case Place::kBehindEscape:
            if (c != '[' && c != 'O') over_ = true;
            place_ = Place::kInSequence;
            parameters_.clear();
            return;
        case Place::kInSequence:
            // Parameters, if any, then a letter or a tilde.
            if (c == ';' || (c >= '0' && c <= '9')) {
                if (parameters_.size() < 2) parameters_ += c;
                return;
            }
            place_ = Place::kBetween;
            // Ctrl+C is none of a sequence's letters.
            if (static_cast<unsigned char>(c) < ' ') return key(c, now);
            return sequence(c == '~' && parameters_ == "1" ? 'H' : c, now);
    }
}

void TerminalKeys::feed(std::string_view bytes, Clock::time_point now) {
    for (const char c : bytes) {
        if (over_) return;
        take(c, now);
    }
}

const InputState& TerminalKeys::at(Clock::time_point now) {
    if (place_ == Place::kBehindEscape && now - escapeAt_ >= kLoneEscape) over_ = true;
    state_.release();
    for (const Held& held : held_)
        if (now < held.until) state_.*held.axis = static_cast<std::int16_t>(held.direction * InputState::kFull);
    if (now < fasterUntil_) state_.held = InputState::kFaster;
    if (hand_) state_.held |= kHandHolds;
    return state_;
}

Expected<Answer> flyByTerminal(Application& application, const Print& print) {
    // Says what is wrong, if anything is, before the terminal is touched.
    if (const Expected<void> begun = application.navigate({.input = InputState{}}); !begun)
        return tl::unexpected(begun.error());
    const Expected<RawTerminal> terminal = RawTerminal::open("fly", "`navigate` and `view` move the wall without one");
    if (!terminal) return tl::unexpected(terminal.error());
    print(std::string(TerminalKeys::help()));
    TerminalKeys keys;
    InputState said;
    while (!keys.over()) {
        const std::optional<std::string> typed = terminal->typed(kTick);
        if (!typed) break;
        // Of this moment, whatever the server takes below: what comes meanwhile is read before it is later.
        const TerminalKeys::Clock::time_point looked = TerminalKeys::Clock::now();
        if (typed->find('?') != std::string::npos) print(std::string(TerminalKeys::help()));
        keys.feed(*typed, looked);
        if (const Expected<bool> there = application.poll(std::chrono::milliseconds(0)); !there) {
            if (application.serverIsOver()) break;
            return tl::unexpected(there.error());
        }
        if (const InputState& now = keys.at(looked); now != said) {
            if (const Expected<void> done = application.navigate({.input = now}); !done)
                return tl::unexpected(done.error());
            said = now;
        }
    }
    // Whatever is held is released by taking leave.
    return Answer{};
}

}  // namespace tessera
