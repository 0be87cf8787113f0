// What peers say once they are connected. Whoever says something its role must not say is closed; nobody else notices.
#include <fmt/format.h>

#include "common/session/ServerSessionImpl.h"

namespace tessera {

void ServerSession::Impl::received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now) {
    Peer* peer = find(connection);
    look(now);
    if (!peer) return;  // closed by us; what was still on its way does not matter
    peer->lastByte = std::max(peer->lastByte, now);
    const MessageInfo& info = infoOf(message);
    // Until it is welcomed a peer knows no epoch; what it said meanwhile comes later.
    const bool knowsNone = !epoch && info.when != SaidWhen::kLater;
    if (peer->stage != Peer::Stage::kPending && epoch != config.epoch && !knowsNone)
        return violated(peer->stage == Peer::Stage::kBulk ? *find(peer->other) : *peer,
                        fmt::format("said {} in epoch {}, and this server is at epoch {}", info.name, epoch.value,
                                    config.epoch.value),
                        now);
    std::visit(
        [&]<Described M>(const M& m) {
            if constexpr (includes(M::kInfo.to, Party::kServer)) {
                if (peer->maySay(M::kInfo)) return on(*peer, m, now);
            }
            misplaced(*peer, M::kInfo, now);
        },
        message);
}

bool ServerSession::Impl::Peer::maySay(const MessageInfo& info) const {
    if (stage == Stage::kPending) return info.when == SaidWhen::kFirst;
    return info.when != SaidWhen::kFirst &&
           info.goes(partyOf(role), Party::kServer, stage == Stage::kBulk ? ChannelKind::kBulk : ChannelKind::kControl);
}

void ServerSession::Impl::misplaced(Peer& peer, const MessageInfo& info, TimePoint now) {
    const std::string name(info.name);
    if (peer.stage == Peer::Stage::kPending) return close(peer, "said " + name + " before Hello");
    if (peer.stage == Peer::Stage::kBulk)
        return violated(*find(peer.other), "said " + name + " on its bulk connection", now);
    const std::string who = peer.role == PeerRole::kHost ? "a host" : "an application";
    violated(peer, who + " must not say " + name + " on its control connection", now);
}

void ServerSession::Impl::malformed(ConnectionId connection, const std::string& reason, TimePoint now) {
    look(now);
    Peer* peer = find(connection);
    if (!peer) return;
    if (peer->stage == Peer::Stage::kControl) return violated(*peer, reason, now);
    close(*peer, reason);  // a stranger, or a bulk connection, which its peer may open again
}

void ServerSession::Impl::on(Peer& peer, const message::BlobRequest& message, TimePoint now) {
    Peer& control = *find(peer.other);
    if (message.length == 0 || message.length > config.maxChunkBytes)
        return violated(control, "asked for " + std::to_string(message.length) + " bytes of a blob at once", now);
    if (control.role == PeerRole::kHost) hostOf(control).syncing.restart(now);
    out.push_back(server_action::BlobRequested{peer.id, message});
}

void ServerSession::Impl::on(Peer& peer, const message::TileImage& message, TimePoint) {
    if (std::find(imageRequests.begin(), imageRequests.end(), message.request) != imageRequests.end())
        out.push_back(server_action::ImageReceived{peer.name, message});
}

void ServerSession::Impl::on(Peer& peer, const message::Request& message, TimePoint) {
    out.push_back(server_action::RequestReceived{peer.id, peer.name, message.id, message.body});
}

void ServerSession::Impl::on(Peer& peer, const message::Upload& message, TimePoint) {
    out.push_back(server_action::UploadReceived{peer.id, message});
}

void ServerSession::Impl::on(Peer& peer, const message::Input& message, TimePoint) {
    hostOf(peer).saidInput = true;
    out.push_back(server_action::InputReceived{peer.name, message.states});
}

void ServerSession::Impl::on(Peer& peer, const message::Heartbeat& message, TimePoint now) {
    const auto sample = peer.clock.received(message, now);
    // The first one is answered soon: the peer wants an estimate of our clock before it shows its first frame. Not
    // here: `now` is when the heartbeat came, and the answer has to say when it goes.
    if (!std::exchange(peer.clockAnswered, true)) nextHeartbeat = std::min(nextHeartbeat, now);
    if (!sample || peer.role != PeerRole::kHost) return;
    // Smoothed as TCP does it (RFC 6298).
    Duration& roundTrip = hostOf(peer).roundTrip;
    roundTrip = roundTrip == Duration::zero() ? sample->roundTrip : roundTrip + (sample->roundTrip - roundTrip) / 8;
}

void ServerSession::Impl::on(Peer& peer, const message::Synced& message, TimePoint now) {
    if (peer.role == PeerRole::kApplication) {  // where it stands is its own affair
        peer.content = {};
        return;
    }
    Host& host = hostOf(peer);
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

void ServerSession::Impl::on(Peer& peer, const message::Ready& message, TimePoint now) {
    Host& host = hostOf(peer);
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

void ServerSession::Impl::on(Peer& peer, const message::Shown& message, TimePoint now) {
    Host& host = hostOf(peer);
    if (!host.everSwapped || message.frame > host.lastSwap)
        return violated(peer, "shows frame " + std::to_string(message.frame.value) + ", which was not released to it",
                        now);
    if (host.everShown && message.frame <= host.lastShown) return;
    host.everShown = true;
    host.lastShown = message.frame;
    // What a host shows that is out of the barrier is no matter of those who are in it.
    if (host.inBarrier()) out.push_back(server_action::FrameShown{host.name, message.frame, message.shownAtNs});
    barrier.shown(host.name, message.frame, now);
    if (host.unshown && message.frame == host.lastSwap) {
        host.unshown = false;
        resync(host, now);
    }
}

void ServerSession::Impl::on(Peer& peer, const message::BlobsHeld& message, TimePoint) {
    Host& host = hostOf(peer);
    host.owedBlobs.erase(message.token);
    for (Announcement& announcement : announcements)
        if (announcement.token == message.token) announcement.awaited.erase(host.name);
    reportEverywhere();
}

void ServerSession::Impl::on(Peer& peer, const message::HashAnswer& message, TimePoint now) {
    Host& host = hostOf(peer);
    if (host.queriesOpen == 0) return violated(peer, "answers a hash query that nobody made", now);
    if (message.sequence > peer.sentThrough)
        return violated(peer, fmt::format("describes itself at list {}, which it was not sent", message.sequence.value), now);
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
    std::string differs = fmt::format("its replica differs at list {}", sequence.value);
    // Its picture of this frame may be wrong: the others go on, it keeps the image it has.
    if (barrier.open() && barrier.contains(host.name) && host.frame == currentFrame())
        heldByMismatch.push_back(host.name);
    if (differsTooOften(host, now)) {
        // Each repair costs a snapshot, and has not helped.
        differs += fmt::format(", as {} times within {:.0f} s; it is sent away", host.mismatches.size(),
                               std::chrono::duration<double>(config.mismatchesWithin).count());
        lose(host, FaultKind::kStateMismatch, differs, frame, now);
        close(peer,
              fmt::format("host '{}': {}. Look at its memory and its installation, then start it again", host.name, differs),
              false);
        return settle(now);
    }
    fault(host, FaultKind::kStateMismatch, differs, frame, now);
    out.push_back(server_action::StateMismatch{host.name, frame, sequence, expected, actual});
    leaveBarrier(host, now);
    host.state = HostState::kSyncing;
    host.synced = false;
    host.mismatched = true;
    host.syncing.restart(now);
    peer.following = false;
    ++host.queriesOpen;
    send(peer.id, message::HashQuery{});
}

bool ServerSession::Impl::differsTooOften(Host& host, TimePoint now) const {
    while (!host.mismatches.empty() && now - host.mismatches.front() > config.mismatchesWithin) host.mismatches.pop_front();
    host.mismatches.push_back(now);
    const bool tooOften = host.mismatches.size() >= config.maxMismatches;
    // These stay: of one that comes again the first within the time is one too many.
    if (host.mismatches.size() > config.maxMismatches) host.mismatches.pop_front();
    return tooOften;
}

}  // namespace tessera
