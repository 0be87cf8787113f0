/// The epoch of a server that starts.
#pragma once

#include <chrono>

#include "common/base/HistoryIds.h"

namespace tessera {

/// Of a server that starts now: above `last`, the highest that is remembered of its wall (zero: none), even where the
/// clock went back meanwhile.
[[nodiscard]] Epoch nextEpoch(Epoch last, std::chrono::system_clock::time_point now);

/// The latest that a host of its wall may say it has seen: 73 years ahead of the clock, so that one that fell back to
/// 1970 still finds its hosts. It grows with the clock: whatever is raised at one server, the next one, started later,
/// takes the hosts that have seen it.
[[nodiscard]] Epoch furthestEpoch(std::chrono::system_clock::time_point now);

}  // namespace tessera
