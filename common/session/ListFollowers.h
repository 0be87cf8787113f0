/// Who follows the committed lists off the barrier, each exactly once and in order.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/session/ListTail.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// A follower asks for a snapshot, is given one, and is sent every list since. Who reads so slowly that too much waits
/// for it is *behind*: it is sent nothing more until it has read half of that, then the lists since, or a new snapshot
/// where they are kept no longer. Lists are kept while somebody waits for a snapshot; while somebody is behind, of no
/// more bytes than a snapshot had (or may wait for a peer); and for a while after a snapshot was given, of no more
/// bytes than that.
///
/// Invariants: what a follower was sent ends at `sentThrough`, without a gap; memory is bounded by `maxTailLists` and
/// `maxTailBytes`. Pure; one owner.
class ListFollowers {
public:
    /// Bytes that wait to be sent to a peer; none where the frame itself waits for it.
    using Unsent = std::function<std::size_t(ConnectionId)>;
    /// `config` outlives it.
    ListFollowers(const ServerSessionConfig& config, Unsent unsent);

    /// The newest time that anybody has looked at: what is kept for who comes soon goes by it.
    void look(TimePoint now) { looked_ = now; }

    /// Says SnapshotWanted. Until it is given one the peer does not follow.
    void ask(ConnectionId connection, const std::string& name, ServerActions& out);
    [[nodiscard]] bool awaitsSnapshot(ConnectionId connection) const { return of(connection).snapshotAsked; }
    /// A snapshot that begins there serves no more: lists since are gone.
    [[nodiscard]] bool tooOld(Sequence sequence) const { return !tail_.covers(sequence); }
    /// ServerSession::snapshotServes.
    [[nodiscard]] bool serves(Sequence sequence, std::size_t bytes) const {
        return tail_.covers(sequence) && tail_.bytesAfter(sequence) <= bytes;
    }

    /// A list that was sent to somebody and names blobs, which are to be fetched.
    struct Fetching {
        ConnectionId connection;
        Sequence sequence;
    };
    /// It is given this one, whose `current` is said here; the caller sends it. Then `sendSince`.
    void given(ConnectionId connection, message::Snapshot& snapshot, Blob content, TimePoint now);
    [[nodiscard]] std::vector<Fetching> sendSince(ConnectionId connection, ServerActions& out);
    /// To all who follow and do not have it yet.
    [[nodiscard]] std::vector<Fetching> send(const CommittedListPtr& list, ServerActions& out);
    /// To those behind who have read enough.
    [[nodiscard]] std::vector<Fetching> catchUp(ServerActions& out);

    /// It stands at this list, which it was sent: the content of its snapshot is fetched no more.
    void synced(ConnectionId connection);
    /// It was sent this list with a frame.
    void sentWithFrame(ConnectionId connection, Sequence sequence) { of_[connection].sentThrough = sequence; }
    /// No further lists, as what it has is wrong. A snapshot that was asked for still comes.
    void pause(ConnectionId connection);
    /// No further lists, and no snapshot.
    void stop(ConnectionId connection);
    /// The peer is gone.
    void forget(ConnectionId connection);

    [[nodiscard]] bool follows(ConnectionId connection) const { return of(connection).following; }
    [[nodiscard]] bool everFollowed(ConnectionId connection) const { return of(connection).everFollowed; }
    [[nodiscard]] Sequence sentThrough(ConnectionId connection) const { return of(connection).sentThrough; }
    /// Whether this list is just what the peer's replica lacks. A snapshot may be ahead of it: it is made of the
    /// committed scene, and a list may be committed before the frame that carries it begins.
    [[nodiscard]] bool lacksJust(ConnectionId connection, const CommittedList& list) const;

    /// The lists themselves: of each frame, whether it changes anything or not.
    void record(const CommittedListPtr& list);
    /// A frame that changes nothing must stand where the last one did.
    [[nodiscard]] bool continues(const CommittedList& list) const {
        return list.changed() || !tail_.started() || list.sequence == tail_.last();
    }
    /// Of the newest lists.
    [[nodiscard]] std::optional<StateHash> hashAt(Sequence sequence) const { return tail_.hashAt(sequence); }

    /// Keeps lists as they are needed now.
    void updateTail();

private:
    struct Follower {
        std::string name;
        bool snapshotAsked = false;
        bool following = false;  ///< has its snapshot: lists are sent to it
        bool everFollowed = false;
        bool behind = false;   ///< follows, but reads so slowly that lists are kept for it, not sent
        Sequence sentThrough;  ///< the last list sent to it, or in its snapshot
        Blob content;          ///< in which its snapshot lies, until it is synced
    };
    [[nodiscard]] const Follower& of(ConnectionId connection) const;
    /// `changes`: the message about this list, once somebody needs it.
    void send(ConnectionId connection, Follower& follower, const CommittedListPtr& list, MessagePtr& changes,
              std::vector<Fetching>& fetching, ServerActions& out);
    void sendSince(ConnectionId connection, Follower& follower, std::vector<Fetching>& fetching, ServerActions& out);

    const ServerSessionConfig& config_;
    Unsent unsent_;
    std::map<ConnectionId, Follower> of_;
    ListTail tail_;
    std::optional<TimePoint> looked_;
    TimePoint keptUntil_{};  ///< for who comes soon after another one
    std::size_t lastSnapshotBytes_ = 0;
};

}  // namespace tessera
