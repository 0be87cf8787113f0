/// Inside of ServerSession: what is known of peers and hosts, and what is done about it. Not for other modules.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <set>

#include "common/session/HeartbeatClock.h"
#include "common/session/ListTail.h"
#include "common/session/ServerSession.h"

namespace tessera {

struct ServerSession::Impl {
    /// One connection. A host or an application is its control connection; its bulk connection hangs on that.
    struct Peer {
        enum class Stage : std::uint8_t { kPending, kControl, kBulk };

        ConnectionId id;
        Stage stage = Stage::kPending;
        PeerRole role = PeerRole::kHost;
        std::string name;
        SessionToken token;
        ConnectionId other;  ///< of a control connection its bulk one, and the other way round
        TimePoint openedAt{};
        TimePoint lastByte{};
        HeartbeatClock clock;
        bool clockAnswered = false;

        bool snapshotAsked = false;
        bool following = false;  ///< has its snapshot: lists are sent to it
        bool everFollowed = false;
        Sequence sentThrough;  ///< the last list sent to it, or in its snapshot
        Blob content;          ///< in which its snapshot lies, until it is synced
        bool behind = false;   ///< follows, but reads so slowly that lists are kept for it, not sent

        /// On this connection, now.
        [[nodiscard]] bool maySay(const MessageInfo& info) const;
    };

    /// How long somebody has for a task, without the time in which we did not do our part of it.
    struct Patience {
        TimePoint since{};
        Duration excused{};

        void restart(TimePoint now) { *this = {now, {}}; }
        /// No more than the time allowed: where we always stand still, deadlines still come.
        void excuse(Duration time, Duration allowed) { excused = std::min(excused + time, allowed); }
        [[nodiscard]] TimePoint deadline(Duration allowed) const { return since + excused + allowed; }
    };

    struct Host {
        std::string name;
        HostState state = HostState::kAbsent;
        ConnectionId connection;
        bool everJoined = false;
        bool everEntered = false;
        TimePoint awaySince{};

        // Others that say its name while it is connected.
        ConnectionId claimedFrom;
        TimePoint claimedSince{}, lastClaim{};

        // Catching up: it may enter once it has said Synced for `mustReach` or later and holds all blobs it was told
        // of.
        bool synced = false;
        Sequence mustReach;
        Patience syncing;
        std::set<std::uint64_t> owedBlobs;  ///< tokens of announcements
        Sequence snapshotSequence;
        StateHash snapshotHash;

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

        bool mismatched = false;  ///< out of the barrier until `repair`
        std::deque<TimePoint> mismatches;  ///< the newest, whatever the connection
        bool unshown = false;     ///< out of the barrier until it says that it shows `lastSwap`
        std::size_t queriesOpen = 0;
        Duration roundTrip{};
        std::uint64_t pixelProbe = 0;
        std::string machine, board;     ///< as its Hello said
        std::string toldNeighbours;     ///< the last, on this connection
        bool saidInput = false;

        [[nodiscard]] bool inBarrier() const { return state == HostState::kLive || state == HostState::kLate; }
        [[nodiscard]] bool mayEnter() const { return state == HostState::kSyncing && synced && owedBlobs.empty(); }
    };

    /// Blobs that a coming list will name. Stays until that list is committed, for hosts that join in between.
    struct Announcement {
        std::uint64_t token = 0;
        std::vector<BlobInfo> blobs;
        std::set<std::string> awaited;
        Patience fetching;
        bool everywhere = false;
    };

    /// A caller that is slow every time gets no more than this: then silence is judged with what is known.
    static constexpr int kGracesInARow = 3;

    explicit Impl(ServerSessionConfig c);

    // ServerSession.cpp: connections, hello, farewell
    void opened(ConnectionId connection, TimePoint now);
    void closed(ConnectionId connection, TimePoint now);
    void on(Peer& peer, const message::Hello& hello, TimePoint now);
    void refuseTaken(Peer& peer, Host& host, TimePoint now);
    void helloBulk(Peer& peer, const message::Hello& hello);
    void admitHost(Peer& peer, Host& host, const message::Hello& hello, TimePoint now);
    void welcome(Peer& peer, TimePoint now);
    /// Above `seen`, if nobody has shown a picture of ours. Everybody welcomed so far starts over.
    [[nodiscard]] bool raiseEpoch(const std::string& host, Epoch seen, TimePoint now);
    void refuse(Peer& peer, ErrorCode code, std::string reason, bool retry);
    void comparePixels(Host& host, std::uint64_t probe);
    /// Tells the hosts of this machine who else is there, where that has changed.
    void tellNeighbours(const std::string& machine);
    void finish(const std::string& reason);

    // ServerSessionMessages.cpp: what welcomed peers say. A message that is for servers and has no `on` does not
    // compile.
    void received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now);
    void malformed(ConnectionId connection, const std::string& reason, TimePoint now);
    void misplaced(Peer& peer, const MessageInfo& said, TimePoint now);
    void on(Peer& peer, const message::Heartbeat& message, TimePoint now);
    void on(Peer& peer, const message::Synced& message, TimePoint now);
    void on(Peer& peer, const message::Ready& message, TimePoint now);
    void on(Peer& peer, const message::Shown& message, TimePoint now);
    void on(Peer& peer, const message::BlobsHeld& message, TimePoint now);
    void on(Peer& peer, const message::BlobRequest& message, TimePoint now);
    void on(Peer& peer, const message::HashAnswer& message, TimePoint now);
    void on(Peer& peer, const message::TileImage& message, TimePoint now);
    void on(Peer& peer, const message::Request& message, TimePoint now);
    void on(Peer& peer, const message::Upload& message, TimePoint now);
    void on(Peer& peer, const message::Input& message, TimePoint now);
    void violated(Peer& peer, const std::string& what, TimePoint now);
    void mismatch(Peer& peer, Host& host, Sequence sequence, StateHash expected, StateHash actual, TimePoint now);
    /// Notes that its hash is wrong: whether it is so too often.
    [[nodiscard]] bool differsTooOften(Host& host, TimePoint now) const;

    // ServerSessionFrames.cpp: frames, catching up, blobs
    [[nodiscard]] bool mayBegin(TimePoint now) const;
    void beginFrame(const message::Begin& begin, TimePoint now);
    void enterSynced(const message::Begin& begin, TimePoint now);
    [[nodiscard]] bool fits(const Peer& peer, const message::Begin& begin) const;
    void record(const message::Begin& begin);
    void follow(Peer& peer, const CommittedListPtr& list, MessagePtr& changes, TimePoint now);
    void catchUp(TimePoint now);
    [[nodiscard]] std::size_t unsent(ConnectionId connection) const {
        return config.unsentBytes ? config.unsentBytes(connection) : 0;
    }
    void askSnapshot(Peer& peer);
    void snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content, TimePoint now);
    void updateTail();
    void announceBlobs(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now);
    void forgetCommitted(const message::Begin& begin);
    void notAwaited(const std::string& host);
    void reportEverywhere();
    void leaveBarrier(Host& host, TimePoint now);
    void resync(Host& host, TimePoint now);
    /// It lives, and does not show what it was told to. Whatever it does then, nobody waits for it: it keeps its connection, as
    /// on a new one it would be let in, and hold the others up, again.
    void leaveUnshown(Host& host, TimePoint now);
    void queryObjects(const std::string& name, std::uint64_t leaf);
    void repair(const std::string& name, TimePoint now);
    void requestImages(std::uint64_t request, FrameNumber frame);
    /// Polls the barrier and carries out what it says. Deadlines are judged by what is known, not by `now` alone: the
    /// Ready of a host may lie unread in the caller's queue.
    void settle(TimePoint now);

    // ServerSessionDeadlines.cpp
    void advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    /// First thing to be done with every time that comes in, of an event or of a look at the clock.
    void look(TimePoint now);
    void excuse(Duration standstill);
    void sendHeartbeats(TimePoint now);
    void closeSilent(TimePoint now);
    void closeUnsynced(TimePoint now);
    void leaveBlobsLate(TimePoint now);
    [[nodiscard]] TimePoint silenceDeadline(const Peer& peer) const;
    [[nodiscard]] bool awaitsSync(const Host& host) const;
    /// The last byte on any of its connections.
    [[nodiscard]] TimePoint lastHeard(const Peer& peer) const;

    [[nodiscard]] Peer* find(ConnectionId connection);
    [[nodiscard]] const Peer* find(ConnectionId connection) const;
    [[nodiscard]] Host* findHost(const std::string& name);
    [[nodiscard]] Host& hostOf(const Peer& peer);
    [[nodiscard]] FrameNumber currentFrame() const;
    void send(ConnectionId connection, MessagePtr message) {
        out.push_back(server_action::Send{connection, std::move(message)});
    }
    void send(ConnectionId connection, Message message) { send(connection, shared(std::move(message))); }
    [[nodiscard]] static MessagePtr shared(Message message) {
        return std::make_shared<const Message>(std::move(message));
    }
    void fault(const Host& host, FaultKind kind, const std::string& detail, FrameNumber frame, TimePoint now);
    /// The host is gone: fault, out of the barrier. What happens to its connection is the caller's.
    void lose(Host& host, FaultKind kind, const std::string& detail, FrameNumber frame, TimePoint now);
    /// Tells a welcomed peer why, closes its connection and its bulk one, and forgets them. `peer` is gone afterwards.
    void close(Peer& peer, const std::string& reason, bool retry = true);
    /// Forgets a connection that is closed, and closes the bulk one that hangs on it.
    void forget(Peer& peer);
    ServerActions take() { return std::exchange(out, {}); }

    ServerSessionConfig config;
    SwapBarrier barrier;
    ListTail tail;
    std::map<ConnectionId, Peer> peers;
    std::vector<Host> hosts;  ///< in the wall's order
    std::deque<Announcement> announcements;
    std::deque<std::uint64_t> imageRequests;
    std::vector<std::string> heldByMismatch;  ///< hosts that drew the open frame from a wrong replica
    std::string probeHost;                    ///< the first host with a pixel probe, the reference
    std::optional<TimePoint> startedAt;
    std::optional<TimePoint> lastAdvance;
    std::optional<TimePoint> lastLook;
    TimePoint graceUntil{};
    int gracesInARow = 0;
    TimePoint knownUntil{};  ///< deadlines are judged as of this instant: the last look without grace
    TimePoint nextHeartbeat{};
    TimePoint tailKeptUntil{};  ///< for who comes soon after another one
    std::size_t lastSnapshotBytes = 0;
    bool finished = false;
    std::string finishReason;
    ServerActions out;
};

}  // namespace tessera
