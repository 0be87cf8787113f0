// Heartbeats, and everything that happens because something else did not.
#include "common/session/ServerSessionImpl.h"

namespace tessera {

void ServerSession::Impl::advance(TimePoint now) {
    if (!startedAt) startedAt = now;
    look(now);
    if (lastAdvance && now - *lastAdvance > config.sync.lostAfter / 2) excuse(now - *lastAdvance);
    lastAdvance = now;
    sendHeartbeats(now);
    barrier.told(now);
    if (now < graceUntil) return;
    closeSilent(now);
    closeUnsynced(now);
    leaveBlobsLate(now);
    updateTail();
    settle(now);
}

/// Neither an event nor a look for so long: the whole process stood still, or nobody is there. What peers said
/// meanwhile may lie unread, in the caller's queue or in sockets: they get a moment.
void ServerSession::Impl::look(TimePoint now) {
    if (lastLook && now - *lastLook > config.sync.lostAfter / 2) {
        gracesInARow = *lastLook < graceUntil ? gracesInARow + 1 : 1;
        if (gracesInARow <= kGracesInARow) graceUntil = now + config.sync.heartbeat;
    }
    lastLook = lastLook ? std::max(*lastLook, now) : now;
    if (now >= graceUntil) knownUntil = std::max(knownUntil, now);
}

/// Who needs us to serve snapshots and blobs has lost that time through no fault of its own.
void ServerSession::Impl::excuse(Duration standstill) {
    for (Host& host : hosts) host.syncing.excuse(standstill, config.syncDeadline);
    for (Announcement& announcement : announcements) announcement.fetching.excuse(standstill, config.blobDeadline);
}

void ServerSession::Impl::sendHeartbeats(TimePoint now) {
    if (now < nextHeartbeat) return;
    nextHeartbeat = now + config.sync.heartbeat;
    for (const auto& [id, peer] : peers)
        if (peer.stage == Peer::Stage::kControl) send(id, peer.clock.next(now));
}

void ServerSession::Impl::closeSilent(TimePoint now) {
    std::vector<ConnectionId> silent;
    for (const auto& [id, peer] : peers)
        if (peer.stage != Peer::Stage::kBulk && now >= silenceDeadline(peer)) silent.push_back(id);
    for (const ConnectionId connection : silent) {
        Peer& peer = *find(connection);
        const std::string reason =
            peer.stage == Peer::Stage::kPending
                ? "no hello within the deadline"
                : "silent for " + std::to_string((now - lastHeard(peer)) / std::chrono::milliseconds(1)) + " ms";
        if (peer.stage == Peer::Stage::kControl && peer.role == PeerRole::kHost)
            lose(hostOf(peer), FaultKind::kSilent, reason, currentFrame(), now);
        close(peer, reason);
    }
}

void ServerSession::Impl::closeUnsynced(TimePoint now) {
    for (Host& host : hosts) {
        if (!awaitsSync(host) || now < host.syncing.deadline(config.syncDeadline)) continue;
        Peer& peer = *find(host.connection);
        const std::string reason = "not in step within " + std::to_string(config.syncDeadline.count()) + " ms";
        lose(host, FaultKind::kDisconnected, reason, currentFrame(), now);
        close(peer, reason);
    }
}

void ServerSession::Impl::leaveBlobsLate(TimePoint now) {
    std::set<std::string> late;
    for (const Announcement& announcement : announcements)
        if (now >= announcement.fetching.deadline(config.blobDeadline))
            late.insert(announcement.awaited.begin(), announcement.awaited.end());
    for (const std::string& name : late) {
        Host& host = *findHost(name);
        fault(host, FaultKind::kBlobsLate, "did not fetch announced data in time", currentFrame(), now);
        resync(host, now);
    }
}

TimePoint ServerSession::Impl::nextDeadline() const {
    // Before the first call with a time there is no start to measure from: ask for one.
    if (!startedAt) return TimePoint{};
    TimePoint next = barrier.nextDeadline();
    bool anybody = false;
    for (const auto& [id, peer] : peers) {
        if (peer.stage == Peer::Stage::kBulk) continue;
        anybody = anybody || peer.stage == Peer::Stage::kControl;
        next = std::min(next, silenceDeadline(peer));
    }
    for (const Host& host : hosts)
        if (awaitsSync(host)) next = std::min(next, host.syncing.deadline(config.syncDeadline));
    for (const Announcement& announcement : announcements)
        if (!announcement.awaited.empty()) next = std::min(next, announcement.fetching.deadline(config.blobDeadline));
    next = std::max(next, graceUntil);
    if (barrier.untold()) return TimePoint{};  // grace is for hosts: we have had our say
    if (anybody) next = std::min(next, nextHeartbeat);
    if (barrier.nextFrame() == config.firstFrame && !barrier.open()) {
        const TimePoint start = *startedAt + config.sync.startDeadline;
        if (!lastAdvance || *lastAdvance < start) next = std::min(next, start);
    }
    return next;
}

TimePoint ServerSession::Impl::silenceDeadline(const Peer& peer) const {
    if (peer.stage == Peer::Stage::kPending) return peer.openedAt + config.helloDeadline;
    return lastHeard(peer) + (peer.role == PeerRole::kHost ? config.sync.lostAfter : config.applicationLostAfter);
}

TimePoint ServerSession::Impl::lastHeard(const Peer& peer) const {
    const Peer* other = find(peer.other);
    return other ? std::max(peer.lastByte, other->lastByte) : peer.lastByte;
}

/// While its snapshot is being made (joining) the delay is ours.
bool ServerSession::Impl::awaitsSync(const Host& host) const {
    return host.state == HostState::kSyncing && !host.mayEnter();
}

}  // namespace tessera
