#include "server/sim/journal/NextEpoch.h"

#include <algorithm>

namespace tessera {

Epoch nextEpoch(Epoch last, std::chrono::system_clock::time_point now) {
    // Without a memory of the last one, nanoseconds since 1970 are higher than those of any start before, unless the
    // clock went back; then a host tells (ServerSession::epoch).
    const auto sinceThen = std::chrono::duration_cast<std::chrono::nanoseconds>(now.time_since_epoch()).count();
    return std::max(last.next(), Epoch(static_cast<std::uint64_t>(std::max<std::int64_t>(sinceThen, 1))));
}

Epoch furthestEpoch(std::chrono::system_clock::time_point now) {
    constexpr std::uint64_t kAhead = std::uint64_t{1} << 61;  // nanoseconds
    return Epoch(nextEpoch({}, now).value + kAhead);
}

}  // namespace tessera
