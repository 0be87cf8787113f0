#include "common/session/SessionDeadlines.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace tessera {

void SessionDeadlines::advance(TimePoint now) {
    excuse(grace_.stoodStill(now));
    sendHeartbeats(now);
    roster_.barrier.told(now);
    if (grace_.lasts(now)) return;
    closeSilent(now);
    closeUnsynced(now);
    leaveBlobsLate(now);
    roster_.followers.updateTail();
    frames_.settle(now);
}

/// Who needs us to serve snapshots and blobs has lost that time through no fault of its own.
void SessionDeadlines::excuse(Duration standstill) {
    if (standstill == Duration::zero()) return;
    for (SessionHost& host : roster_.hosts) host.standing.patience.excuse(standstill, roster_.config.syncDeadline);
    roster_.announcements.excuse(standstill);
}

void SessionDeadlines::sendHeartbeats(TimePoint now) {
    if (!roster_.peers.heartbeatsAreDue(now)) return;
    for (const auto& [id, peer] : roster_.peers)
        if (peer.welcomed()) roster_.send(id, peer.clock.next(now));
    closeEnded(now);
}

/// Closes whoever came in by a token that has ended, or was revoked: as often as heartbeats go out. Programs of the
/// server's user dial again with its new token.
void SessionDeadlines::closeEnded(TimePoint now) {
    constexpr std::string_view kReason = "its token has ended, or was revoked";
    const ServerSessionConfig& config = roster_.config;
    std::vector<ConnectionId> ended;
    for (const auto& [id, peer] : roster_.peers) {
        if (!peer.welcomed() || peer.access.empty() || config.access.roleOf(peer.access)) continue;
        if (!config.passOf || !config.passOf(peer.access)) ended.push_back(id);
    }
    for (const ConnectionId id : ended) {
        SessionPeer& peer = *roster_.peers.find(id);
        if (peer.isHost())
            roster_.lose(roster_.hostOf(peer), FaultKind::kDisconnected, std::string(kReason), roster_.currentFrame(),
                         now);
        roster_.close(peer, std::string(kReason));
    }
}

void SessionDeadlines::closeSilent(TimePoint now) {
    for (const ConnectionId connection : roster_.peers.silent(now)) {
        SessionPeer& peer = *roster_.peers.find(connection);
        if (peer.stage == SessionPeer::Stage::kRefused) {
            const std::string why = peer.answer.reason;
            roster_.send(connection, std::move(peer.answer));
            roster_.close(peer, why);
            continue;
        }
        const std::string reason =
            peer.stage == SessionPeer::Stage::kPending
                ? "no hello within the deadline"
                : fmt::format("silent for {} ms", (now - roster_.peers.lastHeard(peer)) / std::chrono::milliseconds(1));
        if (peer.isHost()) roster_.lose(roster_.hostOf(peer), FaultKind::kSilent, reason, roster_.currentFrame(), now);
        roster_.close(peer, reason);
    }
}

void SessionDeadlines::closeUnsynced(TimePoint now) {
    for (SessionHost& host : roster_.hosts) {
        if (!roster_.awaitsSync(host) || now < host.standing.patience.deadline(roster_.config.syncDeadline)) continue;
        SessionPeer& peer = roster_.peerOf(host);
        const std::string reason = fmt::format("not in step within {} ms", roster_.config.syncDeadline.count());
        roster_.lose(host, FaultKind::kDisconnected, reason, roster_.currentFrame(), now);
        roster_.close(peer, reason);
    }
}

void SessionDeadlines::leaveBlobsLate(TimePoint now) {
    for (const std::string& name : roster_.announcements.late(now)) {
        SessionHost& host = *roster_.find(name);
        roster_.fault(host, FaultKind::kBlobsLate, "did not fetch announced data in time", roster_.currentFrame(), now);
        roster_.resync(host, now);
    }
}

TimePoint SessionDeadlines::next() const {
    // Before the first call with a time there is no start to measure from: ask for one.
    if (!frames_.hasStarted()) return TimePoint{};
    if (roster_.barrier.untold()) return TimePoint{};  // grace is for hosts: we have had our say
    TimePoint next = std::min(
        {roster_.barrier.nextDeadline(), roster_.peers.silenceDeadline(), roster_.announcements.nextDeadline()});
    for (const SessionHost& host : roster_.hosts)
        if (roster_.awaitsSync(host))
            next = std::min(next, host.standing.patience.deadline(roster_.config.syncDeadline));
    next = std::min(std::max(next, grace_.until()), roster_.peers.nextHeartbeat());
    if (const std::optional<TimePoint> start = frames_.startDeadline())
        if (!grace_.lastLookAtClock() || *grace_.lastLookAtClock() < *start) next = std::min(next, *start);
    return next;
}

}  // namespace tessera
