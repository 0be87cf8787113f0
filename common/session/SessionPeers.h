/// Who is connected, as what, and when each was last heard.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/FailedLogins.h"
#include "common/session/HeartbeatClock.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// One connection. A host or an application is its control connection; its bulk connection hangs on that.
struct SessionPeer {
    enum class Stage : std::uint8_t {
        kPending,
        kControl,
        kBulk,
        kRefused,  ///< it hears of it at `answerAt`; what it says meanwhile counts for nothing
    };

    ConnectionId id;
    Stage stage = Stage::kPending;
    PeerRole role = PeerRole::kHost;
    PeerOrigin origin;
    bool ofPanel = false;  ///< it reaches a panel's fields alone
    Entrant who = {};      ///< of an application
    bool ofDoor = false;   ///< the server's own door, which says from where each of its requests comes
    std::string access;    ///< the token that it came in with; empty: it came in otherwise
    std::string name;
    SessionToken token;
    ConnectionId other;  ///< of a control connection its bulk one, and the other way round
    TimePoint openedAt{};
    TimePoint lastByte{};
    HeartbeatClock clock;
    bool clockAnswered = false;
    TimePoint answerAt{};
    message::Refused answer;
    std::optional<FailedLogins::Ticket> slowed;

    [[nodiscard]] bool welcomed() const { return stage == Stage::kControl; }
    [[nodiscard]] bool isHost() const { return welcomed() && role == PeerRole::kHost; }
    [[nodiscard]] bool isApplication() const { return welcomed() && role == PeerRole::kApplication; }
    /// On this connection, now.
    [[nodiscard]] bool maySay(const MessageInfo& info) const;
};

/// All connections by their ids, the deadlines of their silence, and when heartbeats are due. What happens to a peer
/// that is silent is the caller's affair.
///
/// Invariants: a bulk connection's `other` is a control connection whose `other` it is; a byte on either is a sign of
/// life of both. Pure; one owner.
class SessionPeers {
public:
    /// `config` outlives it.
    explicit SessionPeers(const ServerSessionConfig& config) : config_(config) {}

    SessionPeer& open(ConnectionId connection, TimePoint now);
    /// Only this one: what hangs on it is the caller's affair.
    void erase(ConnectionId connection);

    [[nodiscard]] SessionPeer* find(ConnectionId connection);
    [[nodiscard]] const SessionPeer* find(ConnectionId connection) const;
    [[nodiscard]] SessionPeer* controlOf(const SessionToken& token);
    [[nodiscard]] std::vector<ConnectionId> welcomed() const;
    [[nodiscard]] std::size_t applications() const;
    [[nodiscard]] std::size_t applicationsOf(const Entrant& who) const;  ///< wherever from

    void heard(SessionPeer& peer, TimePoint now) { peer.lastByte = std::max(peer.lastByte, now); }
    /// The last byte on any of its connections.
    [[nodiscard]] TimePoint lastHeard(const SessionPeer& peer) const;
    /// Those that have been silent for longer than they may, but for bulk connections: no word is expected of these.
    [[nodiscard]] std::vector<ConnectionId> silent(TimePoint now) const;
    /// When the next one has; TimePoint::max(): there is nobody.
    [[nodiscard]] TimePoint silenceDeadline() const;

    /// Of who is welcomed a heartbeat is due now, or soon.
    void heartbeatSoon(TimePoint now) { nextHeartbeat_ = std::min(nextHeartbeat_, now); }
    void heartbeatNotBefore(TimePoint now) { nextHeartbeat_ = std::max(nextHeartbeat_, now); }
    /// Once for each time that they are.
    [[nodiscard]] bool heartbeatsAreDue(TimePoint now);
    /// TimePoint::max(): nobody is welcomed.
    [[nodiscard]] TimePoint nextHeartbeat() const;

    [[nodiscard]] auto begin() const { return peers_.begin(); }
    [[nodiscard]] auto end() const { return peers_.end(); }

private:
    [[nodiscard]] TimePoint silenceDeadline(const SessionPeer& peer) const;

    const ServerSessionConfig& config_;
    std::map<ConnectionId, SessionPeer> peers_;
    TimePoint nextHeartbeat_{};
};

}  // namespace tessera
