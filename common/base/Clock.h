/// Time comes in through parameters. A simulated cluster hands out its own.
#pragma once

#include <chrono>

namespace tessera {

using Duration = std::chrono::nanoseconds;
/// A point on some monotonic time line. Whose line it is, the user of the value says.
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;

/// For programs and for what has a thread of its own; state machines are told.
[[nodiscard]] inline TimePoint clockNow() {
    return std::chrono::steady_clock::now();
}

[[nodiscard]] inline double toMilliseconds(Duration d) {
    return std::chrono::duration<double, std::milli>(d).count();
}

}  // namespace tessera
