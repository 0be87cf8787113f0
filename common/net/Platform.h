/// The ground of a server, or a host: time, chance, work beside the frames, and the network.
#pragma once

#include "common/base/LaneThreads.h"
#include "common/base/SystemRandom.h"
#include "common/base/TimeSource.h"
#include "common/net/TcpTransport.h"

namespace tessera {

/// As given the machine's; in a simulated wall its own (tests/support/wall).
struct Platform {
    const TimeSource* time = &machineTime();
    std::function<Hash128()> random = systemRandom;  ///< for secrets
    MakeLane lane = LaneThreads::make;
    MakeTransport transport = TcpTransport::make;

    [[nodiscard]] TimePoint now() const { return time->now(); }
    [[nodiscard]] DateTime date() const { return time->date(); }
};

}  // namespace tessera
