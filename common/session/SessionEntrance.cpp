#include "common/session/SessionEntrance.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace tessera {

void SessionEntrance::opened(ConnectionId connection, TimePoint now, const PeerOrigin& origin) {
    roster_.peers.open(connection, now).origin = origin;
}

void SessionEntrance::hello(SessionPeer& peer, const message::Hello& hello, TimePoint now) {
    if (Admission::Verdict verdict = admission_.program(hello)) return refuse(peer, std::move(*verdict));
    if (hello.channel == ChannelKind::kBulk) return bulk(peer, hello);
    const Expected<Entrant> who = admission_.entrantOf(hello, peer.origin);
    // In a key nothing can be guessed, and who has one that has ended is to hear it.
    if (!who && !peer.origin.key && !hello.access.empty()) return refuseLogin(peer, who.error(), now);
    if (!who) return refuse(peer, {who.error().code, who.error().message, false});
    // Of those whom the door asks for it sees to that itself.
    peer.ofDoor = peer.origin.near && roster_.config.access.byDoor(hello.access).has_value();
    if (!peer.ofDoor && (who->by == Entrant::By::kWord || who->by == Entrant::By::kPass)) peer.access = hello.access;
    if (hello.role == PeerRole::kApplication) return application(peer, hello, *who, now);
    if (hello.role == PeerRole::kHost) return host(peer, hello, now);
    refuse(peer, {ErrorCode::kNetwork, "unknown role of a peer", false});
}

void SessionEntrance::bulk(SessionPeer& peer, const message::Hello& hello) {
    SessionPeer* control = roster_.peers.controlOf(hello.token);
    if (!control)
        return refuse(peer, {ErrorCode::kRefused, "no control connection goes with this bulk connection", true});
    if (!Admission::goTogether(control->origin, peer.origin))
        return refuse(peer,
                      {ErrorCode::kRefused, "the bulk connection has another key than its control connection", false});
    if (control->ofPanel) return refuse(peer, {ErrorCode::kRefused, "a panel has no arrays", false});
    if (const SessionPeer* old = roster_.peers.find(control->other)) {
        roster_.out.push_back(server_action::Close{old->id, "replaced by a newer bulk connection"});
        roster_.peers.erase(old->id);
    }
    peer.stage = SessionPeer::Stage::kBulk;
    peer.role = control->role;
    peer.name = control->name;
    peer.other = control->id;
    control->other = peer.id;
}

void SessionEntrance::application(SessionPeer& peer, const message::Hello& hello, Entrant who, TimePoint now) {
    const std::size_t own = roster_.peers.applicationsOf(who);
    if (Admission::Verdict verdict = admission_.application(who, own, roster_.peers.applications() - own))
        return refuse(peer, std::move(*verdict));
    std::shared_ptr<const std::string> panel;
    if (!who.panel.empty()) {
        if (hello.follows)
            return refuse(
                peer, {ErrorCode::kRefused,
                       "a panel's token does not follow the scene: it reaches the fields of its panel alone", false});
        if (roster_.config.panelOf) panel = roster_.config.panelOf(who.panel);
        if (!panel) return refuse(peer, {ErrorCode::kRefused, "the panel of this token is not there any more", false});
    }
    peer.role = PeerRole::kApplication;
    peer.name = hello.name;
    peer.who = who;
    peer.ofPanel = panel != nullptr;
    welcome(peer, now);
    roster_.out.push_back(server_action::ApplicationJoined{peer.id, peer.name, std::move(who), std::move(panel)});
    // Whoever only asks is told what it asks for, and what it has subscribed to.
    if (hello.follows) roster_.followers.ask(peer.id, peer.name, roster_.out);
}

void SessionEntrance::host(SessionPeer& peer, const message::Hello& hello, TimePoint now) {
    SessionHost* host = roster_.find(hello.name);
    if (!host) return refuse(peer, admission_.unknownHost(hello.name));
    if (host->connection)
        return refuse(
            peer, admission_.taken(host->name, host->connection, roster_.peers.lastHeard(roster_.peerOf(*host)), now));
    const bool entered = std::ranges::any_of(roster_.hosts, &SessionHost::everEntered);
    Admission::EpochVerdict verdict = admission_.epochOf(host->name, hello.seenEpoch, entered);
    if (verdict.refused) return refuse(peer, std::move(*verdict.refused));
    if (verdict.raisedFrom) allStartOver(*verdict.raisedFrom, host->name, now);
    admit(peer, *host, hello, now);
}

void SessionEntrance::allStartOver(Epoch from, const std::string& because, TimePoint now) {
    roster_.out.push_back(server_action::EpochRaised{from, admission_.epoch(), because});
    roster_.boards.startOver();
    const std::string reason = "this server has gone on to a higher epoch; start over";
    for (const ConnectionId connection : roster_.peers.welcomed()) {
        SessionPeer& peer = *roster_.peers.find(connection);
        if (peer.role == PeerRole::kHost)
            roster_.lose(roster_.hostOf(peer), FaultKind::kDisconnected, reason, roster_.currentFrame(), now);
        roster_.close(peer, reason);
    }
}

void SessionEntrance::admit(SessionPeer& peer, SessionHost& host, const message::Hello& hello, TimePoint now) {
    peer.role = PeerRole::kHost;
    peer.name = host.name;
    host.state = HostState::kJoining;
    host.connection = peer.id;
    host.everJoined = true;
    host.standing.begin(now);
    host.everBegun = false;
    host.answered = true;
    host.everSwapped = false;
    host.mismatched = false;
    host.unshown = false;
    host.queriesOpen = 0;
    host.roundTrip = {};
    roster_.announcements.comesAnew(host.name);
    welcome(peer, now);
    comparePixels(host.name, hello.pixelProbe);
    roster_.tell(roster_.boards.arrives(host.name, hello.machine, hello.board));
    roster_.followers.ask(peer.id, peer.name, roster_.out);
}

void SessionEntrance::welcome(SessionPeer& peer, TimePoint now) {
    peer.stage = SessionPeer::Stage::kControl;
    peer.token = roster_.config.newToken();
    roster_.peers.heartbeatNotBefore(now);
    roster_.send(peer.id, message::Welcome{.epoch = admission_.epoch(),
                                           .token = peer.token,
                                           .heartbeat = roster_.config.sync.heartbeat,
                                           .lostAfter = roster_.config.sync.lostAfter,
                                           .configuration = roster_.config.configuration});
}

void SessionEntrance::refuse(SessionPeer& peer, Admission::Refusal refusal) {
    roster_.send(peer.id, message::Refused{refusal.code, refusal.reason, refusal.retry});
    roster_.out.push_back(server_action::Close{peer.id, std::move(refusal.reason)});
    roster_.peers.erase(peer.id);
}

/// This machine's programs are not slowed down: they have one address, and one user's would make another's wait.
void SessionEntrance::refuseLogin(SessionPeer& peer, Error why, TimePoint now) {
    const SourceAddress source = peer.origin.source;
    FailedLogins::Verdict verdict =
        peer.origin.near || !source ? FailedLogins::Verdict() : roster_.failedLogins.failed(source, now);
    if (verdict.begins) roster_.out.push_back(server_action::LoginsSlowed{source});
    if (verdict.close) return roster_.close(peer, why.message);
    if (!verdict.ticket) return refuse(peer, {why.code, std::move(why.message), false});
    peer.stage = SessionPeer::Stage::kRefused;
    peer.answerAt = now + verdict.wait;
    peer.answer = {why.code, std::move(why.message), false};
    peer.slowed = std::move(verdict.ticket);
}

void SessionEntrance::comparePixels(const std::string& host, std::uint64_t probe) {
    if (probe == 0) return;  // it did not look
    if (probe_.host.empty()) probe_.host = host;
    if (host == probe_.host)
        probe_.value = probe;
    else if (probe_.value != probe)
        roster_.out.push_back(server_action::PixelsDiffer{host, probe_.host});
}

}  // namespace tessera
