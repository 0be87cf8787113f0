/// What a wall of real processes has shown, and what processor time it took: the difference of two readings.
#pragma once

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tests/integration/LiveWall.h"

namespace tessera::bench {

/// Seconds of processor time that a process has taken in all its threads so far; 0 when it is gone.
[[nodiscard]] inline double processSeconds(pid_t pid) {
    clockid_t clock = 0;
    timespec t{};
    if (clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &t) != 0) return 0;
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct WallReading {
    std::chrono::steady_clock::time_point at;
    std::int64_t frame = 0;          ///< that all tiles show
    double server = 0, clients = 0;  ///< seconds of processor time
};

[[nodiscard]] inline WallReading readWall(test::LiveWall& wall, const std::vector<std::string>& hosts,
                                          const std::vector<std::string>& tiles) {
    WallReading reading;
    reading.at = std::chrono::steady_clock::now();
    reading.server = processSeconds(wall.server().pid());
    for (const std::string& host : hosts) reading.clients += processSeconds(wall.client(host).pid());
    reading.frame = std::numeric_limits<std::int64_t>::max();
    for (const std::string& tile : tiles) reading.frame = std::min(reading.frame, wall.shownFrame(tile));
    return reading;
}

/// The shipped 2x2 wall's.
[[nodiscard]] inline std::vector<std::string> fourTiles() {
    std::vector<std::string> tiles;
    for (const std::string& host : test::kFourHosts) tiles.push_back(test::tileOf(host));
    return tiles;
}

}  // namespace tessera::bench
