#include "common/session/SessionPeers.h"

#include <algorithm>

namespace tessera {

bool SessionPeer::maySay(const MessageInfo& info) const {
    if (stage == Stage::kRefused) return false;
    if (stage == Stage::kPending) return info.when == SaidWhen::kFirst;
    return info.when != SaidWhen::kFirst &&
           info.goes(partyOf(role), Party::kServer, stage == Stage::kBulk ? ChannelKind::kBulk : ChannelKind::kControl);
}

SessionPeer& SessionPeers::open(ConnectionId connection, TimePoint now) {
    TESSERA_CHECK(!find(connection), "a connection opens once");
    return peers_[connection] = SessionPeer{.id = connection, .openedAt = now, .lastByte = now};
}

void SessionPeers::erase(ConnectionId connection) {
    peers_.erase(connection);
}

SessionPeer* SessionPeers::find(ConnectionId connection) {
    const auto it = peers_.find(connection);
    return it == peers_.end() ? nullptr : &it->second;
}

const SessionPeer* SessionPeers::find(ConnectionId connection) const {
    const auto it = peers_.find(connection);
    return it == peers_.end() ? nullptr : &it->second;
}

SessionPeer* SessionPeers::controlOf(const SessionToken& token) {
    if (!token) return nullptr;
    for (auto& [id, peer] : peers_)
        if (peer.welcomed() && peer.token == token) return &peer;
    return nullptr;
}

std::vector<ConnectionId> SessionPeers::welcomed() const {
    std::vector<ConnectionId> all;
    for (const auto& [id, peer] : peers_)
        if (peer.welcomed()) all.push_back(id);
    return all;
}

std::size_t SessionPeers::applications() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(peers_, [](const auto& item) { return item.second.isApplication(); }));
}

std::size_t SessionPeers::applicationsOf(const Entrant& who) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        peers_, [&](const auto& item) { return item.second.isApplication() && item.second.who.isSameAs(who); }));
}

TimePoint SessionPeers::lastHeard(const SessionPeer& peer) const {
    const SessionPeer* other = find(peer.other);
    return other ? std::max(peer.lastByte, other->lastByte) : peer.lastByte;
}

TimePoint SessionPeers::silenceDeadline(const SessionPeer& peer) const {
    if (peer.stage == SessionPeer::Stage::kRefused) return peer.answerAt;
    if (peer.stage == SessionPeer::Stage::kPending) return peer.openedAt + config_.helloDeadline;
    return lastHeard(peer) + (peer.role == PeerRole::kHost ? config_.sync.lostAfter : config_.applicationLostAfter);
}

std::vector<ConnectionId> SessionPeers::silent(TimePoint now) const {
    std::vector<ConnectionId> all;
    for (const auto& [id, peer] : peers_)
        if (peer.stage != SessionPeer::Stage::kBulk && now >= silenceDeadline(peer)) all.push_back(id);
    return all;
}

TimePoint SessionPeers::silenceDeadline() const {
    TimePoint next = TimePoint::max();
    for (const auto& [id, peer] : peers_)
        if (peer.stage != SessionPeer::Stage::kBulk) next = std::min(next, silenceDeadline(peer));
    return next;
}

bool SessionPeers::heartbeatsAreDue(TimePoint now) {
    if (now < nextHeartbeat_) return false;
    nextHeartbeat_ = now + config_.sync.heartbeat;
    return true;
}

TimePoint SessionPeers::nextHeartbeat() const {
    const bool anybody = std::ranges::any_of(peers_, [](const auto& item) { return item.second.welcomed(); });
    return anybody ? nextHeartbeat_ : TimePoint::max();
}

}  // namespace tessera
