#include "common/session/CatchUp.h"

#include <fmt/format.h>

#include <set>
#include <utility>

namespace tessera {

void CatchUp::snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content, TimePoint now) {
    const SessionPeer* peer = roster_.peers.find(connection);
    ListFollowers& followers = roster_.followers;
    if (!peer || !followers.awaitsSnapshot(connection)) return;
    // It took so long that lists since are gone.
    if (followers.tooOld(snapshot.list->sequence)) return followers.ask(connection, peer->name, roster_.out);
    followers.given(connection, snapshot, std::move(content), now);
    if (peer->role == PeerRole::kHost) {
        SessionHost& host = roster_.hostOf(*peer);
        host.state = HostState::kSyncing;
        host.standing.given(snapshot.list->sequence, snapshot.list->stateHash, now);
        for (message::BlobNotice& notice : roster_.announcements.owedNow(host.name))
            roster_.send(connection, std::move(notice));
    }
    roster_.send(connection, std::move(snapshot));
    toFetch(followers.sendSince(connection, roster_.out), now);
}

void CatchUp::sendToSlow(TimePoint now) {
    toFetch(roster_.followers.catchUp(roster_.out), now);
}

void CatchUp::send(const CommittedListPtr& list, TimePoint now) {
    toFetch(roster_.followers.send(list, roster_.out), now);
}

/// What a host has to fetch must not make the barrier wait: it enters after this list, not before.
void CatchUp::toFetch(const std::vector<ListFollowers::Fetching>& fetching, TimePoint now) {
    for (const ListFollowers::Fetching& one : fetching) {
        const SessionPeer* peer = roster_.peers.find(one.connection);
        if (peer->role != PeerRole::kHost) continue;
        SessionHost& host = roster_.hostOf(*peer);
        if (host.state != HostState::kSyncing) continue;
        if (roster_.mayEnter(host)) host.standing.patience.restart(now);
        host.standing.mustReach(one.sequence);
    }
}

void CatchUp::announce(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now) {
    const MessagePtr notice = SessionRoster::shared(message::BlobNotice{token, blobs});
    std::vector<std::string> told;
    std::set<std::string> awaited;
    for (SessionHost& host : roster_.hosts) {
        if (!host.connection) continue;
        if (roster_.mayEnter(host)) host.standing.patience.restart(now);  // it was done; this is a new task
        told.push_back(host.name);
        if (roster_.barrier.contains(host.name)) awaited.insert(host.name);
        roster_.send(host.connection, notice);
    }
    for (const std::uint64_t done :
         roster_.announcements.announce(token, std::move(blobs), told, std::move(awaited), now))
        roster_.out.push_back(server_action::BlobsEverywhere{done});
}

void CatchUp::held(const SessionHost& host, std::uint64_t token) {
    roster_.announcements.held(host.name, token);
    reportEverywhere();
}

void CatchUp::reportEverywhere() {
    for (const std::uint64_t done : roster_.announcements.everywhere())
        roster_.out.push_back(server_action::BlobsEverywhere{done});
}

Expected<CatchUp::Said> CatchUp::synced(SessionPeer& peer, const message::Synced& message, TimePoint now) {
    ListFollowers& followers = roster_.followers;
    if (peer.role == PeerRole::kApplication) {  // where it stands is its own affair
        followers.synced(peer.id);
        return Said::kFine;
    }
    SessionHost& host = roster_.hostOf(peer);
    if (!followers.everFollowed(peer.id) || message.sequence > followers.sentThrough(peer.id))
        return fail(ErrorCode::kRefused,
                    fmt::format("claims to stand at list {}, which it was not sent", message.sequence.value));
    followers.synced(peer.id);
    if (!followers.follows(peer.id)) return Said::kFine;  // overtaken by a mismatch: a new snapshot comes
    std::optional<StateHash> expected = followers.hashAt(message.sequence);
    if (!expected) expected = host.standing.hashOfSnapshot(message.sequence);
    if (expected && *expected != message.stateHash)
        return repairs_.differs(peer, host, message.sequence, *expected, message.stateHash, now) ? Said::kSentAway
                                                                                                 : Said::kFine;
    if (host.state == HostState::kSyncing) host.standing.stands(message.sequence);
    return Said::kFine;
}

}  // namespace tessera
