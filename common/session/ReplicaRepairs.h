/// Hosts whose replica differs: out of the barrier, asked in which object, repaired or sent away.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/session/SessionRoster.h"

namespace tessera {

/// A host that names a wrong hash is out of the barrier, keeps the image that it has, and its replica stands still
/// until `repair`: meanwhile it is asked for its hash tree. Each repair costs a snapshot: at the third time within a
/// minute
/// (`maxMismatches`, `mismatchesWithin`) it has not helped, and the host is sent away, whatever its connection. Such
/// times stay known, so that of one that comes again the first is one too many.
///
/// Invariants: of each host no more times are known than `maxMismatches`; an answer counts only where a query is open.
/// Pure; one owner.
class ReplicaRepairs {
public:
    /// `roster` outlives it.
    explicit ReplicaRepairs(SessionRoster& roster) : roster_(roster) {}

    /// True: it is sent away, and `peer` is gone; the others may have waited for it.
    [[nodiscard]] bool differs(SessionPeer& peer, SessionHost& host, Sequence at, StateHash expected, StateHash actual,
                               TimePoint now);
    /// Fails where nobody has asked, or it speaks of what it was not sent.
    [[nodiscard]] Expected<void> answered(const SessionPeer& peer, SessionHost& host,
                                          const message::HashAnswer& message);
    /// Nothing for a host that has gone, or come back, since.
    void query(const std::string& host, std::uint64_t leaf);
    /// Likewise. True: it starts over.
    [[nodiscard]] bool repair(const std::string& host, TimePoint now);

    /// Hosts that drew the open frame from a wrong replica, since this was asked last.
    [[nodiscard]] std::vector<std::string> heldBack() { return std::exchange(heldBack_, {}); }

private:
    [[nodiscard]] bool tooOften(const std::string& host, TimePoint now);

    SessionRoster& roster_;
    std::map<std::string, std::deque<TimePoint>> times_;  ///< by host: the newest
    std::vector<std::string> heldBack_;
};

}  // namespace tessera
