/// The ground of a server, or a host: time, chance, work beside the frames, and the network.
#pragma once

#include <functional>
#include <thread>

#include "common/base/LaneThreads.h"
#include "common/base/SystemRandom.h"
#include "common/base/TimeSource.h"
#include "common/net/SocketFeeds.h"
#include "common/net/TcpTransport.h"

namespace tessera {

/// As given the machine's; in a simulated wall its own (tests/support/wall).
struct Platform {
    const TimeSource* time = &machineTime();
    std::function<Hash128()> random = systemRandom;  ///< for secrets
    MakeLane lane = LaneThreads::make;
    MakeTransport transport = TcpTransport::make;
    MakeFeeds feeds = SocketFeeds::make;
    /// Lets all others go on until `done`, or until the time has come. Empty: the thread that waits sleeps.
    std::function<void(TimePoint until, const std::function<bool()>& done)> wait = {};

    /// So long a frame waits for a child (which tries a program of a material): where time is simulated, it takes none.
    Duration childPatience{};

    [[nodiscard]] TimePoint now() const { return time->now(); }
    [[nodiscard]] DateTime date() const { return time->date(); }
    void sleepUntil(TimePoint until) const {
        if (wait)
            wait(until, [] { return false; });
        else
            std::this_thread::sleep_until(until);
    }
};

}  // namespace tessera
