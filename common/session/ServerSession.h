/// The server's side of the cluster: who is there, in which state, and which frame everybody is at.
#pragma once

#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/AccessToken.h"
#include "common/base/Entrant.h"
#include "common/base/Identity.h"
#include "common/base/SourceAddress.h"
#include "common/session/Messages.h"
#include "common/session/SwapBarrier.h"

namespace tessera {

using ConnectionId = StrongId<struct ConnectionIdTag>;

enum class HostState : std::uint8_t {
    kAbsent,   ///< never seen
    kJoining,  ///< said hello; its snapshot is being made
    kSyncing,  ///< fetching blobs, applying the snapshot and the lists since
    kLive,     ///< in the barrier
    kLate,     ///< held back this frame (policies hold and drop, and under any who proves itself: SwapBarrier)
    kLost,     ///< disconnected, silent, stalled, or it does not show what it was told to
};
[[nodiscard]] std::string_view nameOf(HostState state);

enum class FaultKind : std::uint8_t {
    kDisconnected,   ///< its connection closed
    kSilent,         ///< no byte for SyncPolicy::lostAfter
    kDrawStalled,    ///< alive by its heartbeats, but missed the frame deadline
    kStateMismatch,  ///< its replica differs; repaired by a snapshot, at the third time in a minute sent away
    kProtocol,       ///< said something a host must not say
    kBlobsLate,      ///< did not fetch announced blobs in time
    kNotShown,       ///< lives, and did not say within SyncPolicy::lostAfter that it shows a frame: out until it does
};
[[nodiscard]] std::string_view nameOf(FaultKind kind);

struct ServerSessionConfig {
    std::vector<std::string> hosts;  ///< every host of the wall
    SyncPolicy sync;
    Epoch epoch{1};
    /// Nobody can have seen a later one: hosts that say so raise nothing and are refused. Servers of a wall that start
    /// later allow more (`furthestEpoch`), or their hosts could be refused for what a stranger has raised here.
    Epoch furthestSeen{std::uint64_t{1} << 63};
    FrameNumber firstFrame;  ///< a server that goes on from another one's frames begins with a later one
    std::uint64_t schema = 0;
    ByteSlice configuration;  ///< handed out in Welcome
    /// A token that nobody else can guess. Tests that repeat themselves have a source of their own.
    std::function<SessionToken()> newToken = randomToken;
    std::size_t maxApplications = 64;
    /// A connection that has not said a valid Hello by then is closed.
    std::chrono::milliseconds helloDeadline{2'000};
    /// A host that neither synced nor asked for a part of a blob for so long is told to start over.
    std::chrono::milliseconds syncDeadline{60'000};
    /// A live host that has not fetched announced blobs by then leaves the barrier.
    std::chrono::milliseconds blobDeadline{10'000};
    /// A host whose hash is wrong so often within that time is sent away, and its program told not to come back by
    /// itself. One that comes all the same, and is wrong again within that time, is sent away at once.
    std::size_t maxMismatches = 3;
    std::chrono::milliseconds mismatchesWithin{60'000};
    /// Applications may be slower than hosts: silent for this long, they are closed.
    std::chrono::milliseconds applicationLostAfter{5'000};
    /// Lists kept for peers whose snapshot is being made. Beyond either bound a newer snapshot is asked for.
    std::size_t maxTailLists = 4096;
    std::size_t maxTailBytes = std::size_t{256} << 20;
    /// For so long after a snapshot was handed out the lists since are kept, so that who joins next, or again, is
    /// served with the same.
    std::chrono::milliseconds snapshotServesFor{60'000};
    /// Announcements that no list has named yet, kept for hosts that join meanwhile. Beyond it the oldest is forgotten.
    std::size_t maxAnnouncements = 256;
    /// A BlobRequest for more than this is a protocol fault.
    std::uint32_t maxChunkBytes = 4u << 20;
    /// Who comes in as what, where their keys do not say so. Without a word or a key nobody does; a wrong one lets
    /// nobody in. Empty: all may do all.
    AccessTokens access = {};
    /// Whom a word lets in that was given for some time, now. May be empty: there are none.
    std::function<std::optional<AccessPass>(std::string_view word)> passOf = {};
    /// The text of a panel that such a word is of; null: it is not there. May be empty: there are none.
    std::function<std::shared_ptr<const std::string>(const std::string& panel)> panelOf = {};
    /// Whoever comes from another machine needs neither key nor word, and may do all (--insecure).
    bool insecure = false;
    std::string owner = {};  ///< whose programs they are, for people
    /// Bytes that wait to be sent to a peer, as whoever sends them knows. May be empty: none ever wait.
    std::function<std::size_t(ConnectionId)> unsentBytes;
    /// Who follows off the barrier and reads more slowly than that gets no further lists and notices. Once it has read
    /// half of them, the lists since, or a new snapshot where those are kept no longer.
    std::size_t maxUnsentBytes = std::size_t{4} << 20;
};

namespace server_action {

struct Send {
    ConnectionId connection;
    MessagePtr message;  ///< the same for all to whom the same is said
};
struct Close {
    ConnectionId connection;
    std::string reason;
};
/// Answer with `snapshotReady(connection, …)` from the committed scene.
struct SnapshotWanted {
    ConnectionId connection;
    std::string name;
};
struct HostEntered {
    std::string host;
    FrameNumber frame;  ///< the first frame it takes part in
    bool rejoined = false;
    Duration awayFor{};               ///< since it was lost; zero on the first time
    std::uint32_t framesToProve = 0;  ///< that it has to draw and show before the others wait for it: SwapBarrier
};
struct Fault {
    std::string host;
    FaultKind kind{};
    FrameNumber frame;         ///< the frame open or next when it was found
    Duration detectedAfter{};  ///< since the last byte received from it
    std::string detail;
};
/// Frame `frame` was released to `shown`; `held` keep their last image.
struct FrameReleased {
    FrameNumber frame;
    std::vector<std::string> shown;
    std::vector<std::string> held;
    Duration barrierTime{};  ///< first Ready to release
    Duration frameTime{};    ///< Begin to release
    std::string lastHost;    ///< whom it waited for
    SwapBarrier::Wait wait;  ///< and how long the others did
};
struct FrameStats {
    std::string host;
    FrameNumber frame;
    ByteSlice stats;
};
struct FrameShown {
    std::string host;
    FrameNumber frame;
    std::int64_t shownAtNs = 0;  ///< on the server's clock, as the host estimates it
};
/// The host's replica stood at `expected` ≠ `actual` after `frame`. Its hash tree follows as `HashesReceived`. The host
/// is out of the barrier and its replica stands still until `repair`. (Not said of one that is sent away for it.)
struct StateMismatch {
    std::string host;
    FrameNumber frame;
    Sequence sequence;  ///< at which the replica stands
    StateHash expected;
    StateHash actual;
};
/// Part of the hash tree of a mismatched host. Answer with `queryObjects` (after leaves) or `repair`.
struct HashesReceived {
    std::string host;
    Sequence sequence;  ///< at which the replica stands
    bool objects = false;
    std::vector<HashEntry> entries;
};
struct RequestReceived {
    ConnectionId connection;
    std::string application;
    std::uint64_t id = 0;
    ByteSlice body;
    std::string from = {};  ///< another address than its link's, as the door says; empty: it is that
};
/// Arrays of an application's next proposal.
struct UploadReceived {
    ConnectionId connection;
    message::Upload upload;
};
/// A host has seen a higher epoch of this wall than the clock gave: from now on it is `to`, and peers start over.
struct EpochRaised {
    Epoch from;
    Epoch to;
    std::string host;
};
struct ApplicationJoined {
    ConnectionId connection;
    std::string name;  ///< as it calls itself
    Entrant who;
    std::shared_ptr<const std::string> panel = {};  ///< the text of the one whose fields it reaches alone; null: none
};
struct ApplicationLeft {
    ConnectionId connection;
};
/// Every live host holds the blobs announced under `token` (or has left the barrier).
struct BlobsEverywhere {
    std::uint64_t token = 0;
};
/// Answer with BlobChunk on the same connection.
struct BlobRequested {
    ConnectionId connection;
    message::BlobRequest request;
};
struct ImageReceived {
    std::string host;
    message::TileImage image;
};
/// What people do at a host's windows now.
struct InputReceived {
    std::string host;
    std::vector<InputState> states;
};
/// The host is gone, and with it whatever was held there.
struct InputEnded {
    std::string host;
};
/// A host's probe image differs from the first host's: its pixels will not match.
struct PixelsDiffer {
    std::string host;
    std::string reference;
};

/// Wrong words have come from there again and again: they are refused more slowly from now on.
struct LoginsSlowed {
    SourceAddress source;
};

}  // namespace server_action

using ServerAction =
    std::variant<server_action::Send, server_action::Close, server_action::SnapshotWanted, server_action::HostEntered,
                 server_action::Fault, server_action::FrameReleased, server_action::FrameStats,
                 server_action::FrameShown, server_action::StateMismatch, server_action::HashesReceived,
                 server_action::RequestReceived, server_action::ApplicationJoined, server_action::ApplicationLeft,
                 server_action::BlobsEverywhere, server_action::BlobRequested, server_action::ImageReceived,
                 server_action::PixelsDiffer, server_action::EpochRaised, server_action::InputReceived,
                 server_action::InputEnded, server_action::UploadReceived, server_action::LoginsSlowed>;
using ServerActions = std::vector<ServerAction>;

/// `more` is to be carried out after what stands there.
inline void append(ServerActions& to, ServerActions more) {
    to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

/// What is known of a connection before its peer has said anything.
struct PeerOrigin {
    bool near = false;                   ///< it comes from this machine
    SourceAddress source = {};           ///< none: unknown
    bool sealed = false;                 ///< nobody else reads it (TLS)
    std::optional<Credential> key = {};  ///< what its peer has proved to be
};

/// Pure state machine: no socket, no clock, no thread. Every call takes the time of the event on the caller's monotonic
/// clock and returns what is to be done, in order. Not thread-safe.
///
/// Whatever a peer says is answered or the peer is closed; nothing a peer says can stop the others. Memory is bounded
/// by the configuration, not by time.
class ServerSession {
public:
    explicit ServerSession(ServerSessionConfig config);
    ~ServerSession();

    [[nodiscard]] ServerActions connectionOpened(ConnectionId connection, TimePoint now, bool near = true,
                                                 SourceAddress source = {});
    /// It is sealed now. Before its first message.
    void connectionSecured(ConnectionId connection, std::optional<Credential> key);
    /// `now` is when the bytes arrived, not when they are looked at.
    /// `epoch` is what the message came with; another one than ours is refused, except by who knows none yet (zero).
    [[nodiscard]] ServerActions received(ConnectionId connection, Epoch epoch, const Message& message, TimePoint now);
    /// To be sent with every message. Higher than any that this wall's hosts have seen: it may rise until a host has
    /// entered the barrier (EpochRaised). Afterwards a host that has seen a higher one is refused.
    [[nodiscard]] Epoch epoch() const;
    /// Bytes that are no message (wrong checksum, undecodable): closes this peer, nobody else.
    [[nodiscard]] ServerActions malformed(ConnectionId connection, const std::string& reason, TimePoint now);
    [[nodiscard]] ServerActions connectionClosed(ConnectionId connection, TimePoint now);
    /// From now on these tokens let in. With the next heartbeats whoever came in by another one is closed.
    void renewAccess(AccessTokens access);
    /// The peer lives: part of a message has come, or one of its messages waits to be handed in.
    void heard(ConnectionId connection, TimePoint now);
    [[nodiscard]] bool isHost(ConnectionId connection) const;
    /// Heartbeats and deadlines. Call when the clock passes `nextDeadline()`, after all events up to then.
    [[nodiscard]] ServerActions advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;

    /// Whether frame `nextFrame()` may begin: none is open, all hosts are there or the start deadline is over, and
    /// whoever was told to show the last frame has said that it does, or is waited for no longer (SwapBarrier). Not
    /// while every host left in the barrier still draws an older frame (policies hold and drop): nobody would draw it.
    [[nodiscard]] bool mayBegin(TimePoint now) const;
    [[nodiscard]] FrameNumber nextFrame() const;
    /// Sends Begin to everybody in the barrier, Changes to everybody who follows off it. Hosts that are synced enter
    /// here, unless their snapshot holds a list of this very frame already: then they enter at the next. With no host
    /// in the barrier the frame is released at once.
    /// Lists are numbered one by one: each is in exactly one frame, in order, and a frame that changes nothing has the
    /// sequence of the frame before it. (Checked: a gap would leave a joining host with another scene.)
    [[nodiscard]] ServerActions beginFrame(const message::Begin& begin, TimePoint now);

    /// The answer to SnapshotWanted. Lists committed after its sequence follow by themselves. Where it lies in a blob,
    /// that can be fetched until the peer is synced.
    [[nodiscard]] ServerActions snapshotReady(ConnectionId connection, message::Snapshot snapshot, Blob content,
                                              TimePoint now);
    [[nodiscard]] ServerActions snapshotReady(ConnectionId connection, message::Snapshot snapshot, TimePoint now) {
        return snapshotReady(connection, std::move(snapshot), Blob(), now);
    }
    /// Whether a snapshot of so many bytes, made at `sequence`, still serves: the lists since then are all here and are
    /// fewer bytes than another one would be.
    [[nodiscard]] bool snapshotServes(Sequence sequence, std::size_t bytes) const;
    /// Announces blobs; BlobsEverywhere follows (at once when no host is live). Tokens are the caller's, each used
    /// once. Joining hosts are told too: they are not waited for, but do not enter the barrier without these blobs.
    [[nodiscard]] ServerActions announceBlobs(std::uint64_t token, std::vector<BlobInfo> blobs, TimePoint now);
    /// Whatever the blobs were announced for is committed or refused: hosts that join are no longer told of them. Those
    /// that lists have named are forgotten by themselves.
    void forgetBlobs(std::uint64_t token);
    [[nodiscard]] ServerActions queryObjects(const std::string& host, std::uint64_t leaf);
    /// A snapshot for a host that `StateMismatch` named; nothing for one that has gone or come back since.
    [[nodiscard]] ServerActions repair(const std::string& host, TimePoint now);
    /// `shrink`, `news`: message::ImageRequest.
    [[nodiscard]] ServerActions requestImages(std::uint64_t request, FrameNumber frame, std::uint32_t shrink = 0,
                                              bool news = false);
    [[nodiscard]] ServerActions reply(ConnectionId application, message::Reply reply);
    [[nodiscard]] ServerActions notify(ConnectionId application, message::Notice notice);
    /// Tells everybody; afterwards nothing is accepted.
    [[nodiscard]] ServerActions finish(const std::string& reason);

    struct HostStatus {
        std::string name;
        HostState state = HostState::kAbsent;
        FrameNumber lastShown;
        bool everShown = false;
        Duration roundTrip{};
    };
    [[nodiscard]] std::vector<HostStatus> hosts() const;
    [[nodiscard]] std::vector<std::string> waitingFor() const;
    /// Hosts that have never joined.
    [[nodiscard]] std::vector<std::string> missing() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
