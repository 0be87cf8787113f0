/// Where the time comes from: the machine, or a simulated wall.
#pragma once

#include <chrono>

#include "common/base/Clock.h"

namespace tessera {

/// A point of the calendar, as people set it.
using DateTime = std::chrono::system_clock::time_point;

/// Whoever paces, waits or has deadlines is handed one and outlived by it. Any thread.
class TimeSource {
public:
    virtual ~TimeSource() = default;
    /// Never goes back.
    [[nodiscard]] virtual TimePoint now() const = 0;
    /// May go back.
    [[nodiscard]] virtual DateTime date() const = 0;
};
[[nodiscard]] const TimeSource& machineTime();

}  // namespace tessera
