/// tessera-check --machine: what this machine has and lacks for a wall, before one is started.
#pragma once

#include <string>
#include <vector>

namespace tessera {

struct MachineFinding {
    enum class State {
        kGood,
        kNote,   ///< lacking for some walls: those of several machines, in windows, on cards
        kLacks,  ///< no wall does without
    };
    std::string thing;  ///< "drawing", "fonts"
    State state = State::kGood;
    std::string what;  ///< what there is, or is not
    std::string cure;  ///< a sentence; empty where all is good
};

/// Looks at all of it: tessera-client, which lies beside this program, says what can draw and show. Some seconds, and
/// half a minute at most where a driver hangs.
[[nodiscard]] std::vector<MachineFinding> checkMachine();

/// "fonts  good  …", the cure in a line of its own; with `json` an object of thing, state, what and cure.
[[nodiscard]] std::string lineOf(const MachineFinding& finding, bool json);

}  // namespace tessera
