#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

#include "common/base/Workers.h"

namespace tessera::neighbours {

/// About so many units to a task, but one at least.
[[nodiscard]] inline std::size_t tasksFor(std::size_t units, std::size_t perTask) {
    return std::max<std::size_t>(1, (units + perTask / 2) / perTask);
}

/// On these workers or, where there are none or but one task, here.
template <typename Task>
void runTasks(Workers* workers, std::size_t count, const Task& task) {
    if (workers == nullptr || count < 2) {
        for (std::size_t i = 0; i < count; ++i) task(i);
    } else {
        workers->run(count, std::cref(task));
    }
}

}  // namespace tessera::neighbours
