/// How much of what a process may keep open may go to one purpose.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <cstddef>

namespace tessera {

/// `most`, or where this process may have few descriptors (`ulimit -n`) the `part`th part of them: connections of one
/// kind then leave some to the others. At least one.
[[nodiscard]] inline std::size_t withinDescriptors(std::size_t most, std::size_t part) {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return most;
    return std::clamp<std::size_t>(static_cast<std::size_t>(limit.rlim_cur) / part, 1, most);
}

}  // namespace tessera
