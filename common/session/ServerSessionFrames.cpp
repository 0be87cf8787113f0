// Frames, who follows them on and off the barrier, and the blobs that have to be there first.
#include <fmt/format.h>

#include "common/session/ServerSessionImpl.h"

namespace tessera {

namespace {
/// Of lists since a snapshot: kept for who comes soon, however small that was.
constexpr std::size_t kFewBytes = 64 * 1024;
}  // namespace

bool ServerSession::Impl::mayBegin(TimePoint now) const {
    if (!barrier.mayBegin()) return false;
    if (barrier.nextFrame() != config.firstFrame) return true;
    if (std::all_of(hosts.begin(), hosts.end(), [](const Host& host) { return host.mayEnter(); })) return true;
    return startedAt && now - *startedAt >= config.sync.startDeadline;
}

void ServerSession::Impl::beginFrame(const message::Begin& begin, TimePoint now) {
    const CommittedList& list = *begin.list;
    TESSERA_CHECK(list.changed() || !tail.started() || list.sequence == tail.last(),
                  "a frame without a list stands where the last one did: nothing is between two frames");
    forgetCommitted(begin);
    catchUp(now);
    enterSynced(begin, now);
    const std::vector<std::string> drawing = barrier.begin(begin.frame, now);
    const MessagePtr toHosts = shared(begin);
    for (const std::string& name : drawing) {
        Host& host = *findHost(name);
        host.state = HostState::kLive;
        host.everBegun = true;
        host.answered = false;
        host.frame = begin.frame;
        host.sequence = list.sequence;
        host.stateHash = list.stateHash;
        find(host.connection)->sentThrough = list.sequence;
        send(host.connection, toHosts);
    }
    if (list.changed()) {
        MessagePtr changes;
        for (auto& [id, peer] : peers)
            if (peer.following) follow(peer, begin.list, changes, now);
    }
    record(begin);
    settle(now);
}

void ServerSession::Impl::enterSynced(const message::Begin& begin, TimePoint now) {
    for (Host& host : hosts) {
        if (!host.mayEnter() || !fits(*find(host.connection), begin)) continue;
        barrier.enter(host.name);
        host.state = HostState::kLive;
        const Duration away = host.everEntered ? std::max(Duration::zero(), now - host.awaySince) : Duration::zero();
        out.push_back(server_action::HostEntered{host.name, begin.frame, host.everEntered, away,
                                                 barrier.framesToProve(host.name)});
        host.everEntered = true;
    }
}

/// Whether this frame's list is just what the peer's replica lacks. A snapshot may be ahead of them: it is made of
/// the committed scene, and a list may be committed before the frame that carries it begins.
bool ServerSession::Impl::fits(const Peer& peer, const message::Begin& begin) const {
    return (begin.list->changed() ? peer.sentThrough.next() : peer.sentThrough) == begin.list->sequence;
}

void ServerSession::Impl::record(const message::Begin& begin) {
    if (begin.list->changed())
        tail.append(begin.list);
    else if (!tail.started())
        tail.startAt(begin.list->sequence, begin.list->stateHash);
}

/// `changes`: the message about this list, once somebody needs it.
void ServerSession::Impl::follow(Peer& peer, const CommittedListPtr& list, MessagePtr& changes, TimePoint now) {
    if (peer.behind || list->sequence <= peer.sentThrough) return;
    // In the barrier the frame itself waits for who does not read.
    if (unsent(peer.id) > config.maxUnsentBytes && !(peer.role == PeerRole::kHost && hostOf(peer).inBarrier())) {
        peer.behind = true;
        return updateTail();
    }
    TESSERA_CHECK(list->sequence == peer.sentThrough.next(), "a follower gets every list");
    peer.sentThrough = list->sequence;
    if (!changes) changes = shared(message::Changes{list});
    send(peer.id, changes);
    if (peer.role != PeerRole::kHost || list->blobs.empty()) return;
    // What it has to fetch must not make the barrier wait: it enters after this list, not before.
    if (Host& host = hostOf(peer); host.state == HostState::kSyncing) {
        if (host.mayEnter()) host.syncing.restart(now);
        host.synced = false;
        host.mustReach = list->sequence;
    }
}

/// Who has read what it was sent gets the lists since; where there are too many, a snapshot.
void ServerSession::Impl::catchUp(TimePoint now) {
    for (auto& [id, peer] : peers) {
        if (!peer.behind || unsent(id) > config.maxUnsentBytes / 2) continue;
        peer.behind = false;
        if (!tail.covers(peer.sentThrough)) {
            askSnapshot(peer);
            continue;
        }
        for (const CommittedListPtr& list : tail.lists()) {
            MessagePtr changes;
            follow(peer, list, changes, now);
        }
        updateTail();
    }
}

void ServerSession::Impl::askSnapshot(Peer& peer) {
    peer.snapshotAsked = true;
    peer.following = false;
    peer.behind = false;
    updateTail();
    out.push_back(server_action::SnapshotWanted{peer.id, peer.name});
}

void ServerSession::Impl::snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content, TimePoint now) {
    Peer* peer = find(connection);
    if (!peer || !peer->snapshotAsked) return;
    if (!tail.covers(snapshot.list->sequence)) return askSnapshot(*peer);  // it took so long that lists since are gone
    peer->snapshotAsked = false;
    peer->following = true;
    peer->everFollowed = true;
    peer->sentThrough = snapshot.list->sequence;
    peer->content = std::move(content);
    snapshot.current = std::max(snapshot.list->sequence, tail.last());
    tailKeptUntil = now + config.snapshotServesFor;
    lastSnapshotBytes = std::max<std::size_t>({snapshot.content.sizeBytes, snapshot.list->encoded.size(), kFewBytes});
    if (peer->role == PeerRole::kHost) {
        Host& host = hostOf(*peer);
        host.state = HostState::kSyncing;
        host.synced = false;
        host.mustReach = snapshot.list->sequence;
        host.snapshotSequence = snapshot.list->sequence;
        host.snapshotHash = snapshot.list->stateHash;
        host.syncing.restart(now);
        for (const Announcement& announcement : announcements)
            if (host.owedBlobs.insert(announcement.token).second)
                send(connection, message::BlobNotice{announcement.token, announcement.blobs});
    }
    send(connection, std::move(snapshot));
    for (const CommittedListPtr& list : tail.lists()) {
        MessagePtr changes;
        follow(*peer, list, changes, now);
    }
    updateTail();
}

void ServerSession::Impl::updateTail() {
    const bool needed = std::any_of(peers.begin(), peers.end(), [](const auto& item) {
        return item.second.snapshotAsked || item.second.behind;
    });
    // For who comes soon: no more than another snapshot would be.
    const bool recent = lastLook && *lastLook < tailKeptUntil;
    tail.keep(needed || recent, needed ? std::numeric_limits<std::size_t>::max() : lastSnapshotBytes);
}

void ServerSession::Impl::announceBlobs(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now) {
    const MessagePtr notice = shared(message::BlobNotice{token, blobs});
    Announcement announcement{.token = token, .blobs = std::move(blobs), .fetching = {.since = now}};
    for (Host& host : hosts) {
        if (!host.connection) continue;
        if (host.mayEnter()) host.syncing.restart(now);  // it was done; this is a new task
        host.owedBlobs.insert(token);
        if (barrier.contains(host.name)) announcement.awaited.insert(host.name);
        send(host.connection, notice);
    }
    announcements.push_back(std::move(announcement));
    reportEverywhere();
    if (announcements.size() > config.maxAnnouncements) {
        const auto oldest = std::find_if(announcements.begin(), announcements.end(),
                                         [](const Announcement& known) { return known.everywhere; });
        if (oldest != announcements.end()) announcements.erase(oldest);
    }
}

void ServerSession::Impl::forgetCommitted(const message::Begin& begin) {
    if (announcements.empty()) return;
    std::set<BlobId> named;
    for (const BlobInfo& blob : begin.list->blobs) named.insert(blob.id);
    std::erase_if(announcements, [&](const Announcement& announcement) {
        return announcement.everywhere && std::all_of(announcement.blobs.begin(), announcement.blobs.end(),
                                                      [&](const BlobInfo& blob) { return named.contains(blob.id); });
    });
}

void ServerSession::Impl::notAwaited(const std::string& host) {
    for (Announcement& announcement : announcements) announcement.awaited.erase(host);
}

void ServerSession::Impl::reportEverywhere() {
    for (Announcement& announcement : announcements) {
        if (announcement.everywhere || !announcement.awaited.empty()) continue;
        announcement.everywhere = true;
        out.push_back(server_action::BlobsEverywhere{announcement.token});
    }
}

void ServerSession::Impl::leaveBarrier(Host& host, TimePoint now) {
    if (host.inBarrier()) host.awaySince = now;
    barrier.leave(host.name);
    notAwaited(host.name);
}

void ServerSession::Impl::resync(Host& host, TimePoint now) {
    leaveBarrier(host, now);
    host.state = HostState::kJoining;
    host.synced = false;
    host.mismatched = false;
    host.syncing.restart(now);
    askSnapshot(*find(host.connection));
}

void ServerSession::Impl::leaveUnshown(Host& host, TimePoint now) {
    fault(host, FaultKind::kNotShown,
          fmt::format("it lives, and has not said in time that it shows frame {}; it is out until it does", host.lastSwap.value),
          host.lastSwap, now);
    leaveBarrier(host, now);
    host.state = HostState::kLost;
    host.unshown = true;
    host.synced = false;
    Peer& peer = *find(host.connection);
    peer.following = false;
    peer.snapshotAsked = false;
}

void ServerSession::Impl::queryObjects(const std::string& name, std::uint64_t leaf) {
    Host* host = findHost(name);
    if (!host || !host->mismatched) return;  // it may have gone meanwhile
    ++host->queriesOpen;
    send(host->connection, message::HashQuery{.objects = true, .leaf = leaf});
}

void ServerSession::Impl::repair(const std::string& name, TimePoint now) {
    Host* host = findHost(name);
    // It may have gone meanwhile, and have come back with a scene of its own.
    if (!host || !host->mismatched || find(host->connection)->snapshotAsked) return;
    resync(*host, now);
    settle(now);
}

void ServerSession::Impl::requestImages(std::uint64_t request, FrameNumber frame) {
    constexpr std::size_t kRemembered = 64;
    imageRequests.push_back(request);
    if (imageRequests.size() > kRemembered) imageRequests.pop_front();
    const MessagePtr message = shared(message::ImageRequest{request, frame});
    for (const Host& host : hosts)
        if (host.inBarrier()) send(host.connection, message);
}

void ServerSession::Impl::settle(TimePoint now) {
    const FrameNumber frame = currentFrame();
    SwapBarrier::Outcome outcome = barrier.poll(now, std::min(now, knownUntil));
    if (outcome.released) {
        const MessagePtr swap = shared(message::Swap{outcome.frame});
        for (const std::string& name : outcome.show) {
            Host& host = *findHost(name);
            host.everSwapped = true;
            host.lastSwap = outcome.frame;
            send(host.connection, swap);
        }
        for (const std::string& name : outcome.held) {
            Host& host = *findHost(name);
            if (host.state == HostState::kLive) host.awaySince = now;
            host.state = HostState::kLate;
            if (!barrier.contains(name)) notAwaited(name);
        }
        for (std::string& name : heldByMismatch) outcome.held.push_back(std::move(name));
        heldByMismatch.clear();
        out.push_back(server_action::FrameReleased{outcome.frame, std::move(outcome.show), std::move(outcome.held),
                                                   outcome.barrierTime, outcome.frameTime, outcome.lastHost,
                                                   std::move(outcome.wait)});
    }
    for (const std::string& name : outcome.unshown) leaveUnshown(*findHost(name), now);
    for (const std::string& name : outcome.stalled) {
        Host& host = *findHost(name);
        const ConnectionId connection = host.connection;
        const std::string detail =
            "no picture of frame " + std::to_string(host.frame.value) + " within the frame deadline";
        lose(host, FaultKind::kDrawStalled, detail, frame, now);
        close(*find(connection), detail);
    }
    reportEverywhere();
}

}  // namespace tessera
