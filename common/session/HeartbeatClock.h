/// Round trip and clock offset from heartbeats, as NTP has it (RFC 5905, section 8: the on-wire protocol).
#pragma once

#include <optional>

#include "common/session/Messages.h"

namespace tessera {

/// One end of one connection. What the other side says about times is checked: a wrong clock there costs the estimate,
/// nothing else.
class HeartbeatClock {
public:
    struct Sample {
        Duration roundTrip{};
        std::int64_t offsetNs = 0;  ///< their clock minus ours, with an error of at most half the round trip
    };

    /// To be sent at `now`, and not earlier or later: so never as the answer to an event that happened some time ago.
    [[nodiscard]] message::Heartbeat next(TimePoint now) const;
    /// Nothing when the heartbeat echoes none of ours, or when its times cannot be.
    std::optional<Sample> received(const message::Heartbeat& heartbeat, TimePoint now);

private:
    std::int64_t lastSentAtNs_ = 0;  ///< theirs
    TimePoint receivedAt_{};
};

[[nodiscard]] inline std::int64_t toNs(TimePoint t) {
    return t.time_since_epoch().count();
}

}  // namespace tessera
