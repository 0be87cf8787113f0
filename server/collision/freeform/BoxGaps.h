/// How far are eight boxes at least from one more? The kernel for this processor.
#pragma once

#include "server/collision/mesh/InstructionSet.h"

namespace tessera::kernel {

/// Columns of eight doubles: the middles' x, y, z; the first direction's x, y, z, the second's, the third's; half
/// sides. Directions are of length 1, at right angles but for rounding.
inline constexpr unsigned kBoxLanes = 8, kBoxColumns = 15;

/// The other box, in the frame of the eight: middle, three directions, half sides; then a direction of length 1 to try
/// besides.
struct BoxOfOne {
    double middle[3], axes[9], half[3], hint[3];
};

/// Into `least`, lower bounds of the first `count` (what is behind them says nothing): along the directions of both,
/// the way between the middles, the hint; negative where none of these parts the boxes. Exact but for rounding: 64
/// units of the largest coordinate. The same bits whatever the set: every lane adds in the same order, and nothing is
/// fused.
using GapsOfBoxes = void (*)(const double* eight, unsigned count, const BoxOfOne& one, double* least);

[[nodiscard]] GapsOfBoxes gapsOfBoxes(InstructionSet set = instructionSet());

}  // namespace tessera::kernel
