/// How a host or an application comes into step: its snapshot, the lists since, and blobs that are to be there first.
#pragma once

#include <string>
#include <vector>

#include "common/session/ReplicaRepairs.h"
#include "common/session/SessionRoster.h"

namespace tessera {

/// Joins what peers lack (ListFollowers, BlobAnnouncements) with how far hosts are (ReplicaStanding).
///
/// Invariants: a host may enter the barrier once it is synced with all that it was sent and owes no blobs; what it has
/// to fetch makes it wait, and not those in the barrier. Pure; one owner.
class CatchUp {
public:
    /// Both outlive it.
    CatchUp(SessionRoster& roster, ReplicaRepairs& repairs) : roster_(roster), repairs_(repairs) {}

    /// The answer to SnapshotWanted.
    void snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content, TimePoint now);
    /// Who has read what it was sent goes on.
    void sendToSlow(TimePoint now);
    /// To all who follow off the barrier.
    void send(const CommittedListPtr& list, TimePoint now);

    void announce(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now);
    void held(const SessionHost& host, std::uint64_t token);
    /// Says which blobs are everywhere by now.
    void reportEverywhere();

    enum class Said : std::uint8_t { kFine, kSentAway };
    /// Fails where it claims what it was not sent. kSentAway: its replica differs too often, and `peer` is gone.
    [[nodiscard]] Expected<Said> synced(SessionPeer& peer, const message::Synced& message, TimePoint now);

private:
    void toFetch(const std::vector<ListFollowers::Fetching>& fetching, TimePoint now);

    SessionRoster& roster_;
    ReplicaRepairs& repairs_;
};

}  // namespace tessera
