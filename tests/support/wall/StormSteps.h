/// Shared by the parts of a Storm: a step under way, and its wall's names.
#pragma once

#include <array>
#include <string>

#include "tests/support/wall/Storm.h"

namespace tessera::simulation {

inline constexpr std::array kCullersCompared = {CullerKind::kNone, CullerKind::kMasked, CullerKind::kTwoPhase};
inline constexpr const char* kFirst = "first";  ///< the application that looks at everything

/// The name of the screen that this culler draws whole.
[[nodiscard]] inline std::string screenOf(CullerKind culler) {
    return "whole-" + std::string(nameOf(culler));
}

struct Storm::StepUnderWay {
    Random& random;
    SimulatedApplication& speaker;
    RandomWords words;
    [[nodiscard]] World& world() const { return wall.world(); }
    SimulatedWall& wall;
};

struct Storm::StormDeed {
    unsigned weight = 1;  ///< how often it is drawn, to others
    std::string (Storm::*does)(StepUnderWay&);
    bool still = false;  ///< what it does to the scene can be undone
};

}  // namespace tessera::simulation
