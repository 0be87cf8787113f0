/// The epoch of a server that starts.
#pragma once

#include <chrono>

#include "common/base/HistoryIds.h"

namespace tessera {

/// Of a server that starts now: above `last`, the highest that is remembered of its wall (zero: none), even where the
/// clock went back meanwhile.
[[nodiscard]] Epoch nextEpoch(Epoch last, std::chrono::system_clock::time_point now);

}  // namespace tessera
