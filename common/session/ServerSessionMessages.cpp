// What peers say once they are connected. Whoever says something its role must not say is closed; nobody else notices.
#include "common/session/ServerSessionImpl.h"

namespace tessera {

void ServerSession::Impl::received(ConnectionId connection, const Message& message, TimePoint now) {
    Peer* peer = find(connection);
    look(now);
    if (!peer) return;  // closed by us; what was still on its way does not matter
    peer->lastByte = std::max(peer->lastByte, now);
    if (peer->stage == Peer::Stage::kPending) {
        if (const auto* greeting = std::get_if<message::Hello>(&message)) return hello(*peer, *greeting, now);
        return close(*peer, "said " + std::string(nameOf(message)) + " before Hello");
    }
    if (peer->stage == Peer::Stage::kBulk) return fromBulk(*peer, message, now);
    if (const auto* beat = std::get_if<message::Heartbeat>(&message)) return heartbeat(*peer, *beat, now);
    if (peer->role == PeerRole::kApplication) return fromApplication(*peer, message, now);
    fromHost(*peer, hostOf(*peer), message, now);
}

void ServerSession::Impl::malformed(ConnectionId connection, const std::string& reason, TimePoint now) {
    look(now);
    Peer* peer = find(connection);
    if (!peer) return;
    if (peer->stage == Peer::Stage::kControl) return violated(*peer, reason, now);
    close(*peer, reason);  // a stranger, or a bulk connection, which its peer may open again
}

void ServerSession::Impl::fromBulk(Peer& peer, const Message& message, TimePoint now) {
    Peer& control = *find(peer.other);
    if (const auto* request = std::get_if<message::BlobRequest>(&message)) {
        if (request->length == 0 || request->length > config.maxChunkBytes)
            return violated(control, "asked for " + std::to_string(request->length) + " bytes of a blob at once", now);
        if (control.role == PeerRole::kHost) hostOf(control).syncing.restart(now);
        out.push_back(server_action::BlobRequested{peer.id, *request});
        return;
    }
    if (const auto* image = std::get_if<message::TileImage>(&message); image && control.role == PeerRole::kHost) {
        if (std::find(imageRequests.begin(), imageRequests.end(), image->request) != imageRequests.end())
            out.push_back(server_action::ImageReceived{control.name, *image});
        return;
    }
    violated(control, "said " + std::string(nameOf(message)) + " on its bulk connection", now);
}

void ServerSession::Impl::fromApplication(Peer& peer, const Message& message, TimePoint now) {
    if (std::holds_alternative<message::Synced>(message)) {  // where it stands is its own affair
        peer.content = {};
        return;
    }
    if (const auto* request = std::get_if<message::Request>(&message)) {
        out.push_back(server_action::RequestReceived{peer.id, peer.name, request->id, request->body});
        return;
    }
    violated(peer, "an application must not say " + std::string(nameOf(message)), now);
}

void ServerSession::Impl::fromHost(Peer& peer, Host& host, const Message& message, TimePoint now) {
    if (const auto* synced = std::get_if<message::Synced>(&message)) return on(peer, host, *synced, now);
    if (const auto* ready = std::get_if<message::Ready>(&message)) return on(peer, host, *ready, now);
    if (const auto* shown = std::get_if<message::Shown>(&message)) return on(peer, host, *shown, now);
    if (const auto* held = std::get_if<message::BlobsHeld>(&message)) return on(peer, host, *held, now);
    if (const auto* hashes = std::get_if<message::HashAnswer>(&message)) return on(peer, host, *hashes, now);
    violated(peer, "a host must not say " + std::string(nameOf(message)) + " on its control connection", now);
}

void ServerSession::Impl::heartbeat(Peer& peer, const message::Heartbeat& beat, TimePoint now) {
    const auto sample = peer.clock.received(beat, now);
    // The first one is answered soon: the peer wants an estimate of our clock before it shows its first frame. Not
    // here: `now` is when the heartbeat came, and the answer has to say when it goes.
    if (!std::exchange(peer.clockAnswered, true)) nextHeartbeat = std::min(nextHeartbeat, now);
    if (!sample || peer.role != PeerRole::kHost) return;
    // Smoothed as TCP does it (RFC 6298).
    Duration& roundTrip = hostOf(peer).roundTrip;
    roundTrip = roundTrip == Duration::zero() ? sample->roundTrip : roundTrip + (sample->roundTrip - roundTrip) / 8;
}

void ServerSession::Impl::on(Peer& peer, Host& host, const message::Synced& message, TimePoint now) {
    if (!peer.everFollowed || message.sequence > peer.sentThrough)
        return violated(
            peer, "claims to stand at list " + std::to_string(message.sequence.value) + ", which it was not sent", now);
    peer.content = {};
    if (!peer.following) return;  // overtaken by a mismatch: a new snapshot comes
    std::optional<StateHash> expected = tail.hashAt(message.sequence);
    if (!expected && message.sequence == host.snapshotSequence) expected = host.snapshotHash;
    if (expected && *expected != message.stateHash)
        return mismatch(peer, host, message.sequence, *expected, message.stateHash, now);
    if (host.state == HostState::kSyncing && message.sequence >= host.mustReach) host.synced = true;
}

void ServerSession::Impl::on(Peer& peer, Host& host, const message::Ready& message, TimePoint now) {
    if (!host.everBegun || message.frame > host.frame)
        return violated(
            peer, "is ready with frame " + std::to_string(message.frame.value) + ", which it was not told to draw",
            now);
    if (message.frame < host.frame || host.answered) return;
    host.answered = true;
    if (!message.stats.empty()) out.push_back(server_action::FrameStats{host.name, message.frame, message.stats});
    if (!host.inBarrier()) return;  // it left the barrier while it drew; its catching up is under way
    if (message.stateHash != host.stateHash) {
        mismatch(peer, host, host.sequence, host.stateHash, message.stateHash, now);
        return settle(now);
    }
    if (const Expected<void> taken = barrier.ready(host.name, message.frame, now); !taken)
        return violated(peer, taken.error().message, now);
    if (host.state == HostState::kLate && !barrier.contains(host.name)) {
        // Dropped, and now done with the old frame: in again once it has applied what was sent meanwhile.
        host.state = HostState::kSyncing;
        host.mustReach = peer.sentThrough;
        host.synced = peer.sentThrough == host.sequence;
        host.syncing.restart(now);
    }
    settle(now);
}

void ServerSession::Impl::on(Peer& peer, Host& host, const message::Shown& message, TimePoint now) {
    if (!host.everSwapped || message.frame > host.lastSwap)
        return violated(peer, "shows frame " + std::to_string(message.frame.value) + ", which was not released to it",
                        now);
    if (host.everShown && message.frame <= host.lastShown) return;
    host.everShown = true;
    host.lastShown = message.frame;
    out.push_back(server_action::FrameShown{host.name, message.frame, message.shownAtNs});
}

void ServerSession::Impl::on(Peer&, Host& host, const message::BlobsHeld& message, TimePoint) {
    host.owedBlobs.erase(message.token);
    for (Announcement& announcement : announcements)
        if (announcement.token == message.token) announcement.awaited.erase(host.name);
    reportEverywhere();
}

void ServerSession::Impl::on(Peer& peer, Host& host, const message::HashAnswer& message, TimePoint now) {
    if (host.queriesOpen == 0) return violated(peer, "answers a hash query that nobody made", now);
    --host.queriesOpen;
    if (host.mismatched)
        out.push_back(server_action::HashesReceived{host.name, message.sequence, message.objects, message.entries});
}

void ServerSession::Impl::violated(Peer& peer, const std::string& what, TimePoint now) {
    if (peer.role == PeerRole::kHost) lose(hostOf(peer), FaultKind::kProtocol, what, currentFrame(), now);
    close(peer, what);
    settle(now);
}

void ServerSession::Impl::mismatch(Peer& peer, Host& host, Sequence sequence, StateHash expected, StateHash actual,
                                   TimePoint now) {
    const FrameNumber frame = host.everBegun ? host.frame : currentFrame();
    fault(host, FaultKind::kStateMismatch, "its replica differs at list " + std::to_string(sequence.value), frame, now);
    out.push_back(server_action::StateMismatch{host.name, frame, sequence, expected, actual});
    // Its picture of this frame may be wrong: the others go on, it keeps the image it has.
    if (barrier.open() && barrier.contains(host.name) && host.frame == currentFrame())
        heldByMismatch.push_back(host.name);
    leaveBarrier(host, now);
    host.state = HostState::kSyncing;
    host.synced = false;
    host.mismatched = true;
    host.syncing.restart(now);
    peer.following = false;
    ++host.queriesOpen;
    send(peer.id, message::HashQuery{});
}

}  // namespace tessera
