#include "common/session/SessionRoster.h"

#include <algorithm>
#include <utility>

namespace tessera {

SessionRoster::SessionRoster(const ServerSessionConfig& c)
    : config(c),
      barrier(c.sync, c.firstFrame),
      peers(c),
      followers(c,
                [this](ConnectionId connection) -> std::size_t {
                    const SessionPeer* peer = peers.find(connection);
                    if (!config.unsentBytes || (peer && peer->isHost() && hostOf(*peer).inBarrier())) return 0;
                    return config.unsentBytes(connection);
                }),
      announcements(c.maxAnnouncements, c.blobDeadline),
      boards(c.hosts) {
    for (const std::string& name : c.hosts) {
        TESSERA_CHECK(!find(name), "every host of a wall has a name of its own");
        hosts.push_back({.name = name});
    }
}

SessionHost* SessionRoster::find(const std::string& host) {
    const auto it = std::ranges::find(hosts, host, &SessionHost::name);
    return it == hosts.end() ? nullptr : &*it;
}

SessionHost& SessionRoster::hostOf(const SessionPeer& peer) {
    SessionHost* host = find(peer.name);
    TESSERA_CHECK(host && host->connection == peer.id, "a welcomed host is in the wall and knows its connection");
    return *host;
}

FrameNumber SessionRoster::currentFrame() const {
    return barrier.open() ? barrier.openFrame() : barrier.nextFrame();
}

bool SessionRoster::mayEnter(const SessionHost& host) const {
    return host.state == HostState::kSyncing && host.standing.synced() && !announcements.owes(host.name);
}

bool SessionRoster::awaitsSync(const SessionHost& host) const {
    return host.state == HostState::kSyncing && !mayEnter(host);
}

void SessionRoster::send(ConnectionId connection, MessagePtr message) {
    out.push_back(server_action::Send{connection, std::move(message)});
}

void SessionRoster::tell(const MachineBoards::News& news) {
    for (const auto& [host, neighbours] : news) send(find(host)->connection, neighbours);
}

void SessionRoster::fault(const SessionHost& host, FaultKind kind, const std::string& detail, FrameNumber frame,
                          TimePoint now) {
    const SessionPeer* peer = peers.find(host.connection);
    const Duration silence = peer ? std::max(Duration::zero(), now - peers.lastHeard(*peer)) : Duration::zero();
    out.push_back(server_action::Fault{host.name, kind, frame, silence, detail});
}

void SessionRoster::leaveBarrier(SessionHost& host, TimePoint now) {
    if (host.inBarrier()) host.awaySince = now;
    barrier.leave(host.name);
    announcements.notAwaited(host.name);
}

void SessionRoster::resync(SessionHost& host, TimePoint now) {
    leaveBarrier(host, now);
    host.state = HostState::kJoining;
    host.mismatched = false;
    host.standing.begin(now);
    followers.ask(host.connection, host.name, out);
}

void SessionRoster::lose(SessionHost& host, FaultKind kind, const std::string& detail, FrameNumber frame,
                         TimePoint now) {
    fault(host, kind, detail, frame, now);
    leaveBarrier(host, now);
    host.state = HostState::kLost;
    host.connection = {};
    host.standing.over();
    host.mismatched = false;
    if (std::exchange(host.saidInput, false)) out.push_back(server_action::InputEnded{host.name});
    tell(boards.leaves(host.name));
}

void SessionRoster::close(SessionPeer& peer, const std::string& reason, bool retry) {
    if (peer.welcomed()) send(peer.id, message::Refused{ErrorCode::kRefused, reason, retry});
    out.push_back(server_action::Close{peer.id, reason});
    forget(peer);
}

void SessionRoster::forget(SessionPeer& peer) {
    const ConnectionId id = peer.id;
    if (SessionPeer* other = peers.find(peer.other)) {
        if (peer.welcomed()) {
            out.push_back(server_action::Close{other->id, "its control connection is closed"});
            peers.erase(other->id);
        } else {
            other->other = {};
        }
    }
    const bool application = peer.isApplication();
    peers.erase(id);
    if (application) out.push_back(server_action::ApplicationLeft{id});
    followers.forget(id);
}

}  // namespace tessera
