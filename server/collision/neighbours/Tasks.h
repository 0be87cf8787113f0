#pragma once

#include <cstddef>
#include <functional>

#include "common/base/Workers.h"

namespace tessera::neighbours {

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
