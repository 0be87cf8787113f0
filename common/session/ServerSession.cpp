#include "common/session/ServerSession.h"

#include <fmt/format.h>

#include "common/base/Hash.h"
#include "common/session/ServerSessionImpl.h"

namespace tessera {

std::string_view nameOf(HostState state) {
    switch (state) {
        case HostState::kAbsent:
            return "absent";
        case HostState::kJoining:
            return "joining";
        case HostState::kSyncing:
            return "syncing";
        case HostState::kLive:
            return "live";
        case HostState::kLate:
            return "late";
        case HostState::kLost:
            return "lost";
    }
    return "unknown";
}

std::string_view nameOf(FaultKind kind) {
    switch (kind) {
        case FaultKind::kDisconnected:
            return "disconnected";
        case FaultKind::kSilent:
            return "silent";
        case FaultKind::kDrawStalled:
            return "draw-stalled";
        case FaultKind::kStateMismatch:
            return "state-mismatch";
        case FaultKind::kProtocol:
            return "protocol";
        case FaultKind::kBlobsLate:
            return "blobs-late";
        case FaultKind::kNotShown:
            return "not-shown";
    }
    return "unknown";
}

ServerSession::Impl::Impl(ServerSessionConfig c)
    : config(std::move(c)), barrier(config.sync, config.firstFrame), tail(config.maxTailLists, config.maxTailBytes) {
    for (const std::string& name : config.hosts) {
        TESSERA_CHECK(!findHost(name), "every host of a wall has a name of its own");
        hosts.push_back({.name = name});
    }
}

void ServerSession::Impl::opened(ConnectionId connection, TimePoint now) {
    TESSERA_CHECK(!find(connection), "a connection opens once");
    if (!startedAt) startedAt = now;
    look(now);
    if (finished) {
        send(connection, message::Over{finishReason});
        out.push_back(server_action::Close{connection, finishReason});
        return;
    }
    // A peer that means it says hello within a round trip: what waits longest is what stays silent.
    std::size_t pending = 0;
    Peer* oldest = nullptr;
    for (auto& [id, peer] : peers) {
        if (peer.stage != Peer::Stage::kPending) continue;
        ++pending;
        if (!oldest || peer.openedAt < oldest->openedAt) oldest = &peer;
    }
    if (oldest && pending >= config.maxPendingConnections) close(*oldest, "too many connections that say nothing");
    peers[connection] = Peer{.id = connection, .openedAt = now, .lastByte = now};
}

void ServerSession::Impl::closed(ConnectionId connection, TimePoint now) {
    look(now);
    Peer* peer = find(connection);
    if (!peer) return;
    if (finished) {
        peers.erase(connection);
        return;
    }
    if (peer->stage == Peer::Stage::kControl && peer->role == PeerRole::kHost)
        lose(hostOf(*peer), FaultKind::kDisconnected, "its connection closed", currentFrame(), now);
    forget(*peer);
    settle(now);
}

void ServerSession::Impl::on(Peer& peer, const message::Hello& hello, TimePoint now) {
    if (hello.protocol != kProtocolVersion)
        return refuse(peer, ErrorCode::kNetwork,
                      "this server speaks protocol version " + std::to_string(kProtocolVersion) +
                          ", the peer version " + std::to_string(hello.protocol) + "; install the same Tessera on both",
                      false);
    if (hello.schema != config.schema)
        return refuse(peer, ErrorCode::kNetwork,
                      "this server's scene has schema " + toHex(config.schema) + ", the peer's " + toHex(hello.schema) +
                          "; install the same Tessera on both",
                      false);
    if (hello.channel == ChannelKind::kBulk) return helloBulk(peer, hello);
    if (hello.role == PeerRole::kApplication) {
        const auto applications = std::count_if(peers.begin(), peers.end(), [](const auto& item) {
            return item.second.stage == Peer::Stage::kControl && item.second.role == PeerRole::kApplication;
        });
        if (static_cast<std::size_t>(applications) >= config.maxApplications)
            return refuse(
                peer, ErrorCode::kRefused,
                "already " + std::to_string(applications) + " applications are connected, the most there may be", true);
        peer.role = PeerRole::kApplication;
        peer.name = hello.name;
        welcome(peer, now);
        out.push_back(server_action::ApplicationJoined{peer.id, peer.name});
        // Whoever only asks is told what it asks for, and what it has subscribed to.
        if (hello.follows) askSnapshot(peer);
        return;
    }
    if (hello.role != PeerRole::kHost) return refuse(peer, ErrorCode::kNetwork, "unknown role of a peer", false);
    Host* host = findHost(hello.name);
    if (!host) {
        return refuse(peer, ErrorCode::kNotFound,
                      fmt::format("unknown host '{}'; the wall has: {}", hello.name, fmt::join(config.hosts, ", ")),
                      false);
    }
    if (host->connection) return refuseTaken(peer, *host, now);
    if (hello.seenEpoch > config.epoch && hello.seenEpoch > config.furthestSeen)
        return refuse(
            peer, ErrorCode::kRefused,
            fmt::format("host '{}' says that it has seen epoch {}, which no server of this wall can have had; "
                        "start it again",
                        host->name, hello.seenEpoch.value),
            false);
    if (hello.seenEpoch > config.epoch && !raiseEpoch(host->name, hello.seenEpoch, now))
        return refuse(
            peer, ErrorCode::kRefused,
            fmt::format("this server is at epoch {}, and host '{}' has seen epoch {} of this wall: a server that "
                        "started later has taken over, or the clock went back; end one of the two, or start "
                        "this one again",
                        config.epoch.value, host->name, hello.seenEpoch.value),
            true);
    admitHost(peer, *host, hello, now);
}

bool ServerSession::Impl::raiseEpoch(const std::string& host, Epoch seen, TimePoint now) {
    // A server that goes on while another one has taken over must not outbid it: its hosts have shown its pictures.
    if (std::ranges::any_of(hosts, [](const Host& h) { return h.everEntered; })) return false;
    if (!seen.next()) return false;
    const Epoch before = std::exchange(config.epoch, seen.next());
    out.push_back(server_action::EpochRaised{before, config.epoch, host});
    for (Host& one : hosts) one.machine.clear();  // they start over, and say it again
    std::vector<ConnectionId> welcomed;
    for (const auto& [id, peer] : peers)
        if (peer.stage == Peer::Stage::kControl) welcomed.push_back(id);
    const std::string reason = "this server has gone on to a higher epoch; start over";
    for (const ConnectionId connection : welcomed) {
        Peer& peer = *find(connection);
        if (peer.role == PeerRole::kHost) lose(hostOf(peer), FaultKind::kDisconnected, reason, currentFrame(), now);
        close(peer, reason);
    }
    return true;
}

/// The holder of the name may have died without a word, which is noticed once it has been silent for long enough.
/// Whoever asks again after that, and the holder has spoken meanwhile, is one too many.
void ServerSession::Impl::refuseTaken(Peer& peer, Host& host, TimePoint now) {
    constexpr Duration kForgotten = std::chrono::seconds(10);  // more than a host waits between two tries
    if (host.claimedFrom != host.connection || now - host.lastClaim > kForgotten) {
        host.claimedFrom = host.connection;
        host.claimedSince = now;
    }
    host.lastClaim = now;
    const Duration noticed = config.sync.lostAfter + kGracesInARow * config.sync.heartbeat;
    const bool speaks = now - host.claimedSince >= noticed && lastHeard(*find(host.connection)) > host.claimedSince;
    if (speaks) host.claimedFrom = {};  // the next one who claims the name begins anew
    const std::string taken = "host '" + host.name + "' is connected already";
    refuse(
        peer, ErrorCode::kRefused,
        speaks ? taken + ", and goes on speaking; end that process, or give this one the name of another host" : taken,
        !speaks);
}

void ServerSession::Impl::helloBulk(Peer& peer, const message::Hello& hello) {
    const auto control = !hello.token ? peers.end() : std::find_if(peers.begin(), peers.end(), [&](const auto& item) {
        return item.second.stage == Peer::Stage::kControl && item.second.token == hello.token;
    });
    if (control == peers.end())
        return refuse(peer, ErrorCode::kRefused, "no control connection goes with this bulk connection", true);
    if (Peer* old = find(control->second.other)) {
        out.push_back(server_action::Close{old->id, "replaced by a newer bulk connection"});
        peers.erase(old->id);
    }
    peer.stage = Peer::Stage::kBulk;
    peer.role = control->second.role;
    peer.name = control->second.name;
    peer.other = control->second.id;
    control->second.other = peer.id;
}

void ServerSession::Impl::admitHost(Peer& peer, Host& host, const message::Hello& hello, TimePoint now) {
    peer.role = PeerRole::kHost;
    peer.name = host.name;
    host.state = HostState::kJoining;
    host.connection = peer.id;
    host.everJoined = true;
    host.synced = false;
    host.syncing.restart(now);
    host.owedBlobs.clear();
    host.everBegun = false;
    host.answered = true;
    host.everSwapped = false;
    host.mismatched = false;
    host.unshown = false;
    host.queriesOpen = 0;
    host.roundTrip = {};
    host.machine = hello.machine;
    host.board = hello.board;
    host.toldNeighbours.clear();
    welcome(peer, now);
    comparePixels(host, hello.pixelProbe);
    tellNeighbours(host.machine);
    askSnapshot(peer);
}

void ServerSession::Impl::tellNeighbours(const std::string& machine) {
    constexpr std::size_t kMostNeighbours = 64, kLongest = 128;  // of a line; bounds what one machine's hosts cost
    if (machine.empty()) return;
    const auto there = [&](const Host& host) {
        return host.connection && host.machine == machine && !host.board.empty() &&
               host.name.size() + host.board.size() < kLongest && host.board.find('\n') == std::string::npos;
    };
    for (Host& host : hosts) {
        if (!there(host)) continue;
        message::Neighbours neighbours;
        std::size_t count = 0;
        for (const Host& other : hosts)
            if (&other != &host && there(other) && count++ < kMostNeighbours)
                neighbours.boards += other.name + " " + other.board + "\n";
        if (neighbours.boards == host.toldNeighbours) continue;
        host.toldNeighbours = neighbours.boards;
        send(host.connection, std::move(neighbours));
    }
}

void ServerSession::Impl::welcome(Peer& peer, TimePoint now) {
    peer.stage = Peer::Stage::kControl;
    peer.token = config.newToken();
    if (nextHeartbeat < now) nextHeartbeat = now;
    send(peer.id, message::Welcome{.epoch = config.epoch,
                                   .token = peer.token,
                                   .heartbeat = config.sync.heartbeat,
                                   .lostAfter = config.sync.lostAfter,
                                   .configuration = config.configuration});
}

void ServerSession::Impl::refuse(Peer& peer, ErrorCode code, std::string reason, bool retry) {
    send(peer.id, message::Refused{code, reason, retry});
    out.push_back(server_action::Close{peer.id, std::move(reason)});
    peers.erase(peer.id);
}

void ServerSession::Impl::comparePixels(Host& host, std::uint64_t probe) {
    if (probe == 0) return;  // it did not look
    host.pixelProbe = probe;
    if (probeHost.empty()) probeHost = host.name;
    if (host.name == probeHost) return;
    if (findHost(probeHost)->pixelProbe != probe) out.push_back(server_action::PixelsDiffer{host.name, probeHost});
}

void ServerSession::Impl::finish(const std::string& reason) {
    if (finished) return;
    finished = true;
    finishReason = reason;
    const MessagePtr over = shared(message::Over{reason});
    for (const auto& [id, peer] : peers)
        if (peer.stage != Peer::Stage::kBulk) send(id, over);
}

void ServerSession::Impl::fault(const Host& host, FaultKind kind, const std::string& detail, FrameNumber frame,
                                TimePoint now) {
    const Peer* peer = find(host.connection);
    const Duration silence = peer ? std::max(Duration::zero(), now - lastHeard(*peer)) : Duration::zero();
    out.push_back(server_action::Fault{host.name, kind, frame, silence, detail});
}

void ServerSession::Impl::lose(Host& host, FaultKind kind, const std::string& detail, FrameNumber frame,
                               TimePoint now) {
    fault(host, kind, detail, frame, now);
    leaveBarrier(host, now);
    host.state = HostState::kLost;
    host.connection = {};
    host.synced = false;
    host.mismatched = false;
    if (std::exchange(host.saidInput, false)) out.push_back(server_action::InputEnded{host.name});
    tellNeighbours(host.machine);
}

void ServerSession::Impl::close(Peer& peer, const std::string& reason, bool retry) {
    if (peer.stage == Peer::Stage::kControl) send(peer.id, message::Refused{ErrorCode::kRefused, reason, retry});
    out.push_back(server_action::Close{peer.id, reason});
    forget(peer);
}

void ServerSession::Impl::forget(Peer& peer) {
    const ConnectionId id = peer.id;
    if (Peer* other = find(peer.other)) {
        if (peer.stage == Peer::Stage::kControl) {
            out.push_back(server_action::Close{other->id, "its control connection is closed"});
            peers.erase(other->id);
        } else {
            other->other = {};
        }
    }
    const bool application = peer.stage == Peer::Stage::kControl && peer.role == PeerRole::kApplication;
    peers.erase(id);
    if (application) out.push_back(server_action::ApplicationLeft{id});
    updateTail();
}

ServerSession::Impl::Peer* ServerSession::Impl::find(ConnectionId connection) {
    const auto it = peers.find(connection);
    return it == peers.end() ? nullptr : &it->second;
}

const ServerSession::Impl::Peer* ServerSession::Impl::find(ConnectionId connection) const {
    const auto it = peers.find(connection);
    return it == peers.end() ? nullptr : &it->second;
}

ServerSession::Impl::Host* ServerSession::Impl::findHost(const std::string& name) {
    const auto it = std::find_if(hosts.begin(), hosts.end(), [&](const Host& host) { return host.name == name; });
    return it == hosts.end() ? nullptr : &*it;
}

ServerSession::Impl::Host& ServerSession::Impl::hostOf(const Peer& peer) {
    Host* host = findHost(peer.name);
    TESSERA_CHECK(host && host->connection == peer.id, "a welcomed host is in the wall and knows its connection");
    return *host;
}

FrameNumber ServerSession::Impl::currentFrame() const {
    return barrier.open() ? barrier.openFrame() : barrier.nextFrame();
}

// ---- the public face -----------------------------------------------------------------------------------------------

ServerSession::ServerSession(ServerSessionConfig config) : impl_(std::make_unique<Impl>(std::move(config))) {}
ServerSession::~ServerSession() = default;

ServerActions ServerSession::connectionOpened(ConnectionId connection, TimePoint now) {
    impl_->opened(connection, now);
    return impl_->take();
}

ServerActions ServerSession::received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now) {
    if (!impl_->finished) impl_->received(connection, epoch, message, now);
    return impl_->take();
}

Epoch ServerSession::epoch() const {
    return impl_->config.epoch;
}

ServerActions ServerSession::malformed(ConnectionId connection, const std::string& reason, TimePoint now) {
    if (!impl_->finished) impl_->malformed(connection, reason, now);
    return impl_->take();
}

ServerActions ServerSession::connectionClosed(ConnectionId connection, TimePoint now) {
    impl_->closed(connection, now);
    return impl_->take();
}

void ServerSession::heard(ConnectionId connection, TimePoint now) {
    if (Impl::Peer* peer = impl_->find(connection)) peer->lastByte = std::max(peer->lastByte, now);
}

bool ServerSession::isHost(ConnectionId connection) const {
    const Impl::Peer* peer = impl_->find(connection);
    return peer && peer->stage == Impl::Peer::Stage::kControl && peer->role == PeerRole::kHost;
}

ServerActions ServerSession::advance(TimePoint now) {
    if (!impl_->finished) impl_->advance(now);
    return impl_->take();
}

TimePoint ServerSession::nextDeadline() const {
    return impl_->finished ? TimePoint::max() : impl_->nextDeadline();
}

bool ServerSession::mayBegin(TimePoint now) const {
    return !impl_->finished && impl_->mayBegin(now);
}

FrameNumber ServerSession::nextFrame() const {
    return impl_->barrier.nextFrame();
}

ServerActions ServerSession::beginFrame(const message::Begin& begin, TimePoint now) {
    if (!impl_->finished) impl_->beginFrame(begin, now);
    return impl_->take();
}

ServerActions ServerSession::snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content,
                                           TimePoint now) {
    if (!impl_->finished) impl_->snapshotReady(connection, std::move(snapshot), std::move(content), now);
    return impl_->take();
}

bool ServerSession::snapshotServes(Sequence sequence, std::size_t bytes) const {
    return impl_->tail.covers(sequence) && impl_->tail.bytesAfter(sequence) <= bytes;
}

ServerActions ServerSession::announceBlobs(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now) {
    if (!impl_->finished) impl_->announceBlobs(token, std::move(blobs), now);
    return impl_->take();
}

void ServerSession::forgetBlobs(std::uint64_t token) {
    std::erase_if(impl_->announcements, [&](const auto& announcement) { return announcement.token == token; });
}

ServerActions ServerSession::queryObjects(const std::string& host, std::uint64_t leaf) {
    if (!impl_->finished) impl_->queryObjects(host, leaf);
    return impl_->take();
}

ServerActions ServerSession::repair(const std::string& host, TimePoint now) {
    if (!impl_->finished) impl_->repair(host, now);
    return impl_->take();
}

ServerActions ServerSession::requestImages(std::uint64_t request, FrameNumber frame) {
    if (!impl_->finished) impl_->requestImages(request, frame);
    return impl_->take();
}

ServerActions ServerSession::reply(ConnectionId application, message::Reply reply) {
    const Impl::Peer* peer = impl_->find(application);
    if (!impl_->finished && peer && peer->stage == Impl::Peer::Stage::kControl && peer->role == PeerRole::kApplication)
        impl_->send(application, std::move(reply));
    return impl_->take();
}

ServerActions ServerSession::notify(ConnectionId application, message::Notice notice) {
    const Impl::Peer* peer = impl_->find(application);
    if (!impl_->finished && peer && peer->stage == Impl::Peer::Stage::kControl &&
        peer->role == PeerRole::kApplication && impl_->unsent(application) <= impl_->config.maxUnsentBytes)
        impl_->send(application, std::move(notice));
    return impl_->take();
}

ServerActions ServerSession::finish(const std::string& reason) {
    impl_->finish(reason);
    return impl_->take();
}

std::vector<ServerSession::HostStatus> ServerSession::hosts() const {
    std::vector<HostStatus> all;
    for (const Impl::Host& host : impl_->hosts)
        all.push_back({host.name, host.state, host.lastShown, host.everShown, host.roundTrip});
    return all;
}

std::vector<std::string> ServerSession::waitingFor() const {
    return impl_->barrier.waitingFor();
}

std::vector<std::string> ServerSession::missing() const {
    std::vector<std::string> names;
    for (const Impl::Host& host : impl_->hosts)
        if (!host.everJoined) names.push_back(host.name);
    return names;
}

}  // namespace tessera
