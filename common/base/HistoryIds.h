/// Where in its history a scene or a wall stands. Four numbers that are alike to a compiler and must not be to us.
#pragma once

#include "common/base/Hash.h"
#include "common/base/StrongId.h"

namespace tessera {

/// Position of a list in the history of one epoch; the first committed list is 1, the empty scene stands at 0.
using Sequence = StrongId<struct SequenceTag>;
/// Frames are numbered from 0; simulation time of frame n is n / 60 s.
using FrameNumber = StrongId<struct FrameNumberTag>;
/// Grows with every start of a server.
using Epoch = StrongId<struct EpochTag>;
/// Hash of all that a scene holds (`Aspect::stateHash`): equal scenes, equal hash, whatever led to them.
using StateHash = StrongId<struct StateHashTag>;
[[nodiscard]] inline std::string toHex(StateHash hash) {
    return toHex(hash.value);
}

}  // namespace tessera
