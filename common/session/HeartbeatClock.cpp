#include "common/session/HeartbeatClock.h"

namespace tessera {

namespace {
/// An echo older than this tells nothing about the link.
constexpr std::int64_t kOldestEchoNs = 60'000'000'000;
/// Far from the ends of int64, so that no difference of two clocks overflows.
constexpr std::int64_t kLargestClockNs = std::int64_t{1} << 61;
}  // namespace

message::Heartbeat HeartbeatClock::next(TimePoint now) const {
    const std::int64_t held = lastSentAtNs_ == 0 ? 0 : std::max<std::int64_t>(0, toNs(now) - toNs(receivedAt_));
    return {.sentAtNs = toNs(now), .echoNs = lastSentAtNs_, .heldNs = held};
}

std::optional<HeartbeatClock::Sample> HeartbeatClock::received(const message::Heartbeat& heartbeat, TimePoint now) {
    if (heartbeat.sentAtNs == 0) return std::nullopt;  // a sign of life, by whoever has no clock at hand
    if (heartbeat.sentAtNs <= -kLargestClockNs || heartbeat.sentAtNs >= kLargestClockNs) return std::nullopt;
    lastSentAtNs_ = heartbeat.sentAtNs;
    receivedAt_ = now;
    const std::int64_t nowNs = toNs(now);
    if (heartbeat.echoNs == 0 || heartbeat.echoNs > nowNs || heartbeat.echoNs < nowNs - kOldestEchoNs)
        return std::nullopt;
    const std::int64_t away = nowNs - heartbeat.echoNs;
    if (heartbeat.heldNs < 0 || heartbeat.heldNs > away) return std::nullopt;
    const std::int64_t roundTrip = away - heartbeat.heldNs;
    return Sample{Duration(roundTrip), heartbeat.sentAtNs + roundTrip / 2 - nowNs};
}

}  // namespace tessera
