/// How long somebody has for a task.
#pragma once

#include <algorithm>

#include "common/base/Clock.h"

namespace tessera {

/// The time since a task was given, without the time in which we did not do our part of it.
struct Patience {
    TimePoint since{};
    Duration excused{};

    void restart(TimePoint now) { *this = {now, {}}; }
    /// No more than the time allowed: where we always stand still, deadlines still come.
    void excuse(Duration time, Duration allowed) { excused = std::min(excused + time, allowed); }
    [[nodiscard]] TimePoint deadline(Duration allowed) const { return since + excused + allowed; }
};

}  // namespace tessera
