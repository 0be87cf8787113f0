/// The hosts of the wall and how each of them does; how one goes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/FailedLogins.h"
#include "common/session/BlobAnnouncements.h"
#include "common/session/ListFollowers.h"
#include "common/session/MachineBoards.h"
#include "common/session/ReplicaStanding.h"
#include "common/session/ServerSession.h"
#include "common/session/SessionPeers.h"

namespace tessera {

struct SessionHost {
    std::string name;
    HostState state = HostState::kAbsent;
    ConnectionId connection;
    bool everJoined = false;
    bool everEntered = false;
    TimePoint awaySince{};
    ReplicaStanding standing;

    // The frame it was last told to draw.
    bool everBegun = false;
    bool answered = true;
    FrameNumber frame;
    Sequence sequence;  ///< of that frame
    StateHash stateHash;

    bool everSwapped = false;
    FrameNumber lastSwap;
    bool everShown = false;
    FrameNumber lastShown;

    bool mismatched = false;      ///< out of the barrier until `repair`
    std::size_t queriesOpen = 0;  ///< for its hashes
    bool unshown = false;         ///< out of the barrier until it says that it shows `lastSwap`
    Duration roundTrip{};
    bool saidInput = false;

    [[nodiscard]] bool inBarrier() const { return state == HostState::kLive || state == HostState::kLate; }
};

/// All that the session knows of those who are there, shared by the classes that act on it (SessionEntrance, CatchUp,
/// FrameRound, ReplicaRepairs, SessionDeadlines): each field has one owner that says what it means. Actions are
/// appended to `out` in the order in which they are to be carried out.
///
/// Invariants: a host that is joining, syncing, live or late has a connection, and its peer has its name; who leaves is
/// out of the barrier, waited for by nobody, and its neighbours know. Pure; one owner.
class SessionRoster {
public:
    /// `config` outlives it.
    explicit SessionRoster(const ServerSessionConfig& config);
    SessionRoster(const SessionRoster&) = delete;
    SessionRoster& operator=(const SessionRoster&) = delete;

    const ServerSessionConfig& config;
    SwapBarrier barrier;
    FailedLogins failedLogins;  ///< before those who wait for their answers
    SessionPeers peers;
    ListFollowers followers;
    BlobAnnouncements announcements;
    MachineBoards boards;
    std::vector<SessionHost> hosts;  ///< in the wall's order
    ServerActions out;

    [[nodiscard]] SessionHost* find(const std::string& host);
    /// Of a welcomed host's control connection.
    [[nodiscard]] SessionHost& hostOf(const SessionPeer& peer);
    [[nodiscard]] SessionPeer& peerOf(const SessionHost& host) { return *peers.find(host.connection); }
    [[nodiscard]] FrameNumber currentFrame() const;
    /// It has all that the next frame needs.
    [[nodiscard]] bool mayEnter(const SessionHost& host) const;
    /// Its syncing is judged. While its snapshot is being made (joining) the delay is ours.
    [[nodiscard]] bool awaitsSync(const SessionHost& host) const;

    void send(ConnectionId connection, MessagePtr message);
    void send(ConnectionId connection, Message message) { send(connection, shared(std::move(message))); }
    [[nodiscard]] static MessagePtr shared(Message message) {
        return std::make_shared<const Message>(std::move(message));
    }
    void tell(const MachineBoards::News& news);

    void fault(const SessionHost& host, FaultKind kind, const std::string& detail, FrameNumber frame, TimePoint now);
    void leaveBarrier(SessionHost& host, TimePoint now);
    /// Its replica is to begin anew.
    void resync(SessionHost& host, TimePoint now);
    /// The host is gone: fault, out of the barrier. What happens to its connection is the caller's.
    void lose(SessionHost& host, FaultKind kind, const std::string& detail, FrameNumber frame, TimePoint now);
    /// Tells a welcomed peer why, closes its connection and its bulk one, and forgets them. `peer` is gone afterwards.
    void close(SessionPeer& peer, const std::string& reason, bool retry = true);
    /// Forgets a connection that is closed, and closes the bulk one that hangs on it. `peer` is gone afterwards.
    void forget(SessionPeer& peer);
};

}  // namespace tessera
