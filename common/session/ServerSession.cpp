#include "common/session/ServerSession.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/session/CatchUp.h"
#include "common/session/FrameRound.h"
#include "common/session/Grace.h"
#include "common/session/ImageCalls.h"
#include "common/session/ReplicaRepairs.h"
#include "common/session/SessionDeadlines.h"
#include "common/session/SessionEntrance.h"
#include "common/session/SessionRoster.h"

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

/// Who gets what is said. A message that is for servers and has no `on` does not compile.
struct ServerSession::Impl {
    explicit Impl(ServerSessionConfig c) : config(std::move(c)) {}

    void look(TimePoint now);
    void opened(ConnectionId connection, TimePoint now, const PeerOrigin& origin);
    void closed(ConnectionId connection, TimePoint now);
    void received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now);
    void malformed(ConnectionId connection, const std::string& reason, TimePoint now);
    void misplaced(SessionPeer& peer, const MessageInfo& said, TimePoint now);
    void violated(SessionPeer& peer, const std::string& what, TimePoint now);
    /// What an owner says of a message of this peer.
    void judge(SessionPeer& peer, const Expected<void>& said, TimePoint now) {
        if (!said) violated(peer, said.error().message, now);
    }

    void on(SessionPeer& peer, const message::Hello& message, TimePoint now) { entrance.hello(peer, message, now); }
    void on(SessionPeer& peer, const message::Heartbeat& message, TimePoint now);
    void on(SessionPeer& peer, const message::Synced& message, TimePoint now);
    void on(SessionPeer& peer, const message::Ready& message, TimePoint now) {
        judge(peer, frames.ready(peer, message, now), now);
    }
    void on(SessionPeer& peer, const message::Shown& message, TimePoint now) {
        judge(peer, frames.shown(peer, message, now), now);
    }
    void on(SessionPeer& peer, const message::BlobsHeld& message, TimePoint) {
        catchUp.held(roster.hostOf(peer), message.token);
    }
    void on(SessionPeer& peer, const message::BlobRequest& message, TimePoint now);
    void on(SessionPeer& peer, const message::HashAnswer& message, TimePoint now) {
        judge(peer, repairs.answered(peer, roster.hostOf(peer), message), now);
    }
    void on(SessionPeer& peer, const message::TileImage& message, TimePoint) {
        if (images.knows(message.request)) roster.out.push_back(server_action::ImageReceived{peer.name, message});
    }
    void on(SessionPeer& peer, const message::Request& message, TimePoint) {
        roster.out.push_back(server_action::RequestReceived{peer.id, peer.name, message.id, message.body,
                                                            peer.ofDoor ? message.from : std::string()});
    }
    void on(SessionPeer& peer, const message::Upload& message, TimePoint) {
        roster.out.push_back(server_action::UploadReceived{peer.id, message});
    }
    void on(SessionPeer& peer, const message::Input& message, TimePoint) {
        roster.hostOf(peer).saidInput = true;
        roster.out.push_back(server_action::InputReceived{peer.name, message.states});
    }

    void requestImages(const message::ImageRequest& request);
    /// A welcomed application, while anything is said at all; null: there is none.
    [[nodiscard]] const SessionPeer* application(ConnectionId connection) const;
    void finish(const std::string& reason);
    ServerActions take() { return std::exchange(roster.out, {}); }

    ServerSessionConfig config;
    Grace grace{config.sync};
    SessionRoster roster{config};
    ReplicaRepairs repairs{roster};
    CatchUp catchUp{roster, repairs};
    FrameRound frames{roster, catchUp, repairs, grace};
    SessionDeadlines deadlines{roster, grace, frames};
    SessionEntrance entrance{roster};
    ImageCalls images;
    bool finished = false;
    std::string finishReason;
};

void ServerSession::Impl::look(TimePoint now) {
    grace.look(now);
    roster.followers.look(*grace.lastLook());
}

void ServerSession::Impl::opened(ConnectionId connection, TimePoint now, const PeerOrigin& origin) {
    frames.started(now);
    look(now);
    if (!finished) return entrance.opened(connection, now, origin);
    roster.send(connection, message::Over{finishReason});
    roster.out.push_back(server_action::Close{connection, finishReason});
}

void ServerSession::Impl::closed(ConnectionId connection, TimePoint now) {
    look(now);
    SessionPeer* peer = roster.peers.find(connection);
    if (!peer) return;
    if (finished) return roster.peers.erase(connection);
    if (peer->isHost())
        roster.lose(roster.hostOf(*peer), FaultKind::kDisconnected, "its connection closed", roster.currentFrame(),
                    now);
    roster.forget(*peer);
    frames.settle(now);
}

void ServerSession::Impl::received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now) {
    SessionPeer* peer = roster.peers.find(connection);
    look(now);
    if (!peer || peer->stage == SessionPeer::Stage::kRefused) return;  // what was still on its way does not matter
    roster.peers.heard(*peer, now);
    const MessageInfo& info = infoOf(message);
    // Until it is welcomed a peer knows no epoch; what it said meanwhile comes later.
    const bool knowsNone = !epoch && info.when != SaidWhen::kLater;
    if (peer->stage != SessionPeer::Stage::kPending && epoch != entrance.epoch() && !knowsNone)
        return violated(peer->stage == SessionPeer::Stage::kBulk ? *roster.peers.find(peer->other) : *peer,
                        fmt::format("said {} in epoch {}, and this server is at epoch {}", info.name, epoch.value,
                                    entrance.epoch().value),
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

void ServerSession::Impl::misplaced(SessionPeer& peer, const MessageInfo& info, TimePoint now) {
    const std::string name(info.name);
    if (peer.stage == SessionPeer::Stage::kPending) return roster.close(peer, "said " + name + " before Hello");
    if (peer.stage == SessionPeer::Stage::kBulk)
        return violated(*roster.peers.find(peer.other), "said " + name + " on its bulk connection", now);
    const std::string who = peer.role == PeerRole::kHost ? "a host" : "an application";
    violated(peer, who + " must not say " + name + " on its control connection", now);
}

void ServerSession::Impl::malformed(ConnectionId connection, const std::string& reason, TimePoint now) {
    look(now);
    SessionPeer* peer = roster.peers.find(connection);
    if (!peer) return;
    if (peer->welcomed()) return violated(*peer, reason, now);
    if (peer->stage == SessionPeer::Stage::kRefused) return;
    roster.close(*peer, reason);  // a stranger, or a bulk connection, which its peer may open again
}

/// Whoever says something its role must not say is closed; nobody else notices.
void ServerSession::Impl::violated(SessionPeer& peer, const std::string& what, TimePoint now) {
    if (peer.role == PeerRole::kHost)
        roster.lose(roster.hostOf(peer), FaultKind::kProtocol, what, roster.currentFrame(), now);
    roster.close(peer, what);
    frames.settle(now);
}

void ServerSession::Impl::on(SessionPeer& peer, const message::Heartbeat& message, TimePoint now) {
    const auto sample = peer.clock.received(message, now);
    // The first one is answered soon: the peer wants an estimate of our clock before it shows its first frame. Not
    // here: `now` is when the heartbeat came, and the answer has to say when it goes.
    if (!std::exchange(peer.clockAnswered, true)) roster.peers.heartbeatSoon(now);
    if (!sample || peer.role != PeerRole::kHost) return;
    // Smoothed as TCP does it (RFC 6298).
    Duration& roundTrip = roster.hostOf(peer).roundTrip;
    roundTrip = roundTrip == Duration::zero() ? sample->roundTrip : roundTrip + (sample->roundTrip - roundTrip) / 8;
}

void ServerSession::Impl::on(SessionPeer& peer, const message::Synced& message, TimePoint now) {
    const Expected<CatchUp::Said> said = catchUp.synced(peer, message, now);
    if (!said) return violated(peer, said.error().message, now);
    if (*said == CatchUp::Said::kSentAway) frames.settle(now);
}

void ServerSession::Impl::on(SessionPeer& peer, const message::BlobRequest& message, TimePoint now) {
    SessionPeer& control = *roster.peers.find(peer.other);
    if (message.length == 0 || message.length > config.maxChunkBytes)
        return violated(control, fmt::format("asked for {} bytes of a blob at once", message.length), now);
    if (control.role == PeerRole::kHost) roster.hostOf(control).standing.patience.restart(now);
    roster.out.push_back(server_action::BlobRequested{peer.id, message});
}

void ServerSession::Impl::requestImages(const message::ImageRequest& request) {
    images.made(request.request);
    const MessagePtr message = SessionRoster::shared(message::ImageRequest(request));
    for (const SessionHost& host : roster.hosts)
        if (host.inBarrier()) roster.send(host.connection, message);
}

const SessionPeer* ServerSession::Impl::application(ConnectionId connection) const {
    const SessionPeer* peer = finished ? nullptr : roster.peers.find(connection);
    return peer && peer->isApplication() ? peer : nullptr;
}

void ServerSession::Impl::finish(const std::string& reason) {
    if (finished) return;
    finished = true;
    finishReason = reason;
    const MessagePtr over = SessionRoster::shared(message::Over{reason});
    for (const auto& [id, peer] : roster.peers)
        if (peer.stage != SessionPeer::Stage::kBulk) roster.send(id, over);
}

// ---- the public face -----------------------------------------------------------------------------------------------

ServerSession::ServerSession(ServerSessionConfig config) : impl_(std::make_unique<Impl>(std::move(config))) {}
ServerSession::~ServerSession() = default;

ServerActions ServerSession::connectionOpened(ConnectionId connection, TimePoint now, bool near, SourceAddress source) {
    impl_->opened(connection, now, {.near = near, .source = source});
    return impl_->take();
}

void ServerSession::connectionSecured(ConnectionId connection, std::optional<Credential> key) {
    SessionPeer* const peer = impl_->roster.peers.find(connection);
    if (peer == nullptr) return;
    peer->origin.sealed = true;
    peer->origin.key = std::move(key);
}

ServerActions ServerSession::received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now) {
    if (!impl_->finished) impl_->received(connection, epoch, message, now);
    return impl_->take();
}

Epoch ServerSession::epoch() const {
    return impl_->entrance.epoch();
}

ServerActions ServerSession::malformed(ConnectionId connection, const std::string& reason, TimePoint now) {
    if (!impl_->finished) impl_->malformed(connection, reason, now);
    return impl_->take();
}

ServerActions ServerSession::connectionClosed(ConnectionId connection, TimePoint now) {
    impl_->closed(connection, now);
    return impl_->take();
}

void ServerSession::renewAccess(AccessTokens access) {
    impl_->config.access = std::move(access);
}

void ServerSession::heard(ConnectionId connection, TimePoint now) {
    if (SessionPeer* peer = impl_->roster.peers.find(connection)) impl_->roster.peers.heard(*peer, now);
}

bool ServerSession::isHost(ConnectionId connection) const {
    const SessionPeer* peer = impl_->roster.peers.find(connection);
    return peer && peer->isHost();
}

ServerActions ServerSession::advance(TimePoint now) {
    if (impl_->finished) return impl_->take();
    impl_->frames.started(now);
    impl_->look(now);
    impl_->deadlines.advance(now);
    return impl_->take();
}

TimePoint ServerSession::nextDeadline() const {
    return impl_->finished ? TimePoint::max() : impl_->deadlines.next();
}

bool ServerSession::mayBegin(TimePoint now) const {
    return !impl_->finished && impl_->frames.mayBegin(now);
}

FrameNumber ServerSession::nextFrame() const {
    return impl_->roster.barrier.nextFrame();
}

ServerActions ServerSession::beginFrame(const message::Begin& begin, TimePoint now) {
    if (!impl_->finished) impl_->frames.begin(begin, now);
    return impl_->take();
}

ServerActions ServerSession::snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content,
                                           TimePoint now) {
    if (!impl_->finished) impl_->catchUp.snapshotReady(connection, std::move(snapshot), std::move(content), now);
    return impl_->take();
}

bool ServerSession::snapshotServes(Sequence sequence, std::size_t bytes) const {
    return impl_->roster.followers.serves(sequence, bytes);
}

ServerActions ServerSession::announceBlobs(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now) {
    if (!impl_->finished) impl_->catchUp.announce(token, std::move(blobs), now);
    return impl_->take();
}

void ServerSession::forgetBlobs(std::uint64_t token) {
    impl_->roster.announcements.forget(token);
}

ServerActions ServerSession::queryObjects(const std::string& host, std::uint64_t leaf) {
    if (!impl_->finished) impl_->repairs.query(host, leaf);
    return impl_->take();
}

ServerActions ServerSession::repair(const std::string& host, TimePoint now) {
    if (!impl_->finished && impl_->repairs.repair(host, now)) impl_->frames.settle(now);
    return impl_->take();
}

ServerActions ServerSession::requestImages(std::uint64_t request, FrameNumber frame, std::uint32_t shrink, bool news) {
    if (!impl_->finished) impl_->requestImages({request, frame, shrink, news});
    return impl_->take();
}

ServerActions ServerSession::reply(ConnectionId application, message::Reply reply) {
    if (impl_->application(application)) impl_->roster.send(application, std::move(reply));
    return impl_->take();
}

ServerActions ServerSession::notify(ConnectionId application, message::Notice notice) {
    const std::function<std::size_t(ConnectionId)>& unsent = impl_->config.unsentBytes;
    if (impl_->application(application) && (!unsent || unsent(application) <= impl_->config.maxUnsentBytes))
        impl_->roster.send(application, std::move(notice));
    return impl_->take();
}

ServerActions ServerSession::finish(const std::string& reason) {
    impl_->finish(reason);
    return impl_->take();
}

std::vector<ServerSession::HostStatus> ServerSession::hosts() const {
    std::vector<HostStatus> all;
    for (const SessionHost& host : impl_->roster.hosts)
        all.push_back({host.name, host.state, host.lastShown, host.everShown, host.roundTrip});
    return all;
}

std::vector<std::string> ServerSession::waitingFor() const {
    return impl_->roster.barrier.waitingFor();
}

std::vector<std::string> ServerSession::missing() const {
    std::vector<std::string> names;
    for (const SessionHost& host : impl_->roster.hosts)
        if (!host.everJoined) names.push_back(host.name);
    return names;
}

}  // namespace tessera
