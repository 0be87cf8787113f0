/// One peer's side of the cluster: a render host, or an application that follows the scene.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/Limits.h"
#include "common/session/BlobFetcher.h"
#include "common/session/Messages.h"

namespace tessera {

struct ClientSessionConfig {
    std::string name;
    PeerRole role = PeerRole::kHost;
    std::uint64_t schema = 0;
    std::uint64_t pixelProbe = 0;
    /// The highest epoch in which a server of this wall has welcomed this process; a lower one is left again.
    Epoch seenEpoch;
    std::string machine, board;  ///< hosts: see message::Hello
    /// The word that lets it in, or an empty one: asked for once the server is there. May be empty.
    std::function<std::string(const std::string& peer)> access = {};
    bool wantBlobs = true;
    bool follows = true;  ///< false: an application that only asks; it is sent neither snapshot nor lists
    std::size_t maxBlobBytes = limits::kMaxBlobBytes;  ///< one blob; refused before memory is taken
    std::uint32_t chunkBytes = 256 * 1024;
    std::uint32_t chunksInFlight = 8;
    std::size_t maxUnwantedBytes = FetchLimits().maxUnwantedBytes;  ///< see there
    /// Silence of the server for this long counts as a broken connection.
    std::chrono::milliseconds serverLostAfter{5'000};
    /// Until the server has welcomed this peer, which it does between two frames, and if it is more than that.
    std::chrono::milliseconds welcomeAfter{0};
    /// Pause before a bulk connection that broke or could not be made is tried again.
    std::chrono::milliseconds bulkRetry{200};
    /// Chunks are under way and none comes for this long: the bulk connection is dead, though the other one lives.
    std::chrono::milliseconds bulkStuckAfter{15'000};
    /// What may wait behind missing blobs and slow drawing, and behind what comes first, which may be a whole scene;
    /// beyond either bound the connection is given up.
    std::size_t maxQueuedMessages = 16'384;
    std::size_t maxQueuedBytes = std::size_t{256} << 20;
    /// Reads the blob in which a large snapshot lies (codec SnapshotCodec). Without it such a snapshot ends the
    /// connection.
    std::function<Expected<CommittedListPtr>(const Blob&)> openContent;
    /// Where else than at the server blobs may be had, where they are put, and where to begin with many: see
    /// FetchLimits.
    std::function<Blob(const BlobInfo&)> elsewhere = {};
    std::function<std::unique_ptr<BlobPlace>(const BlobInfo&)> place = {};
    double firstShare = 0;
    /// Application requests and images that may wait for their channel.
    std::size_t maxWaitingRequests = 256;
    std::size_t maxWaitingImages = 64;
};

namespace client_action {

struct Send {
    ChannelKind channel;
    Message message;
};
/// Open the bulk connection; then call `channelOpened(kBulk)`.
struct OpenBulk {};
/// The wall has been handed out (Welcome).
struct Configured {
    Epoch epoch;
    ByteSlice configuration;
    std::chrono::milliseconds heartbeat{};  ///< that the server asks for
};
/// Make this the scene. All blobs it names are here (as far as `wantBlobs`). Answer with `applied`.
struct ApplySnapshot {
    message::Snapshot snapshot;
};
/// Apply this list (off the barrier). Answer with `applied`.
struct ApplyChanges {
    message::Changes changes;
};
/// Apply `begin.list`, draw, and answer with `drawn`. Never a second one before the first is answered.
struct Draw {
    message::Begin begin;
};
/// Make image `frame` the one shown, then call `shown`.
struct Show {
    FrameNumber frame;
};
/// Keep this blob; it is complete and its hash is right.
struct StoreBlob {
    Blob blob;
};
/// Answer with `hashes`.
struct DescribeState {
    message::HashQuery query;
};
struct SendImages {
    message::ImageRequest request;
};
/// These hosts are on this machine; no others are.
struct MeetNeighbours {
    message::Neighbours neighbours;
};
struct ReplyReceived {
    message::Reply reply;
};
struct NoticeReceived {
    message::Notice notice;
};
/// The connection is useless: close all channels, and dial again if `retry`.
struct Disconnect {
    std::string reason;
    bool retry = true;
    ErrorCode code = ErrorCode::kNetwork;
};
/// The server said that it is over: exit 0.
struct Finish {
    std::string reason;
};

}  // namespace client_action

using ClientAction =
    std::variant<client_action::Send, client_action::OpenBulk, client_action::Configured, client_action::ApplySnapshot,
                 client_action::ApplyChanges, client_action::Draw, client_action::Show, client_action::StoreBlob,
                 client_action::DescribeState, client_action::SendImages, client_action::ReplyReceived,
                 client_action::NoticeReceived, client_action::Disconnect, client_action::Finish,
                 client_action::MeetNeighbours>;
using ClientActions = std::vector<ClientAction>;

/// Pure state machine for one connection to a server (make a new one for each attempt; known blobs are handed over).
/// No socket, no clock, no thread; not thread-safe. Work that takes time (apply, draw) is handed out as actions and
/// answered by a call. Snapshot, lists, frames, swaps and hash queries are handed out one at a time in the order of the
/// server, each once the one before is answered: so a host says Ready(n + 1) only after it has shown n.
///
/// After Disconnect or Finish every call is harmless and returns nothing.
class ClientSession {
public:
    explicit ClientSession(ClientSessionConfig config);
    ~ClientSession();

    /// `peer`: the other end, as a number, "ADDR:PORT".
    [[nodiscard]] ClientActions channelOpened(ChannelKind channel, TimePoint now, const std::string& peer = {});
    /// `epoch` is what the message came with: once welcomed, the server's.
    [[nodiscard]] ClientActions received(ChannelKind channel, Epoch epoch, const Message& message, TimePoint now);
    /// To be sent with every message: the server's, zero until it is known.
    [[nodiscard]] Epoch epoch() const;
    /// Bytes that are no message (wrong checksum, undecodable): gives the connection up.
    [[nodiscard]] ClientActions malformed(ChannelKind channel, const std::string& reason);
    /// Also for a bulk connection that could not be made.
    [[nodiscard]] ClientActions channelClosed(ChannelKind channel, TimePoint now);
    /// Part of a message has come: the server lives.
    void heard(ChannelKind channel, TimePoint now);
    /// Heartbeats and deadlines.
    [[nodiscard]] ClientActions advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;

    /// Blobs that are here already (cache) and need not be fetched.
    void holdBlob(const BlobId& id);
    /// The owner has let go of this blob: should a list name it again, it is fetched again.
    void dropBlob(const BlobId& id);

    /// What an earlier session had fetched in part, so that a connection that breaks costs only the rest.
    [[nodiscard]] BlobFetcher::Parts takeParts();
    void resume(BlobFetcher::Parts parts);

    [[nodiscard]] ClientActions applied(Sequence sequence, StateHash stateHash);
    /// A list or snapshot could not be applied: asks for a fresh snapshot by reconnecting.
    [[nodiscard]] ClientActions applyFailed(const std::string& reason);
    [[nodiscard]] ClientActions drawn(FrameNumber frame, StateHash stateHash, ByteSlice stats);
    [[nodiscard]] ClientActions shown(FrameNumber frame, TimePoint at);
    [[nodiscard]] ClientActions hashes(message::HashAnswer answer);
    [[nodiscard]] ClientActions image(message::TileImage image);
    [[nodiscard]] ClientActions request(message::Request request);
    /// Like a request it waits for the welcome; they go out in the order of these calls.
    [[nodiscard]] ClientActions upload(message::Upload upload);

    /// The server's clock minus ours, in ns, from the heartbeat with the shortest round trip so far.
    [[nodiscard]] std::int64_t clockOffsetNs() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
