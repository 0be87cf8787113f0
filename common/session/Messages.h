/// What servers, hosts and applications say to each other. Content (change lists, views, statistics, wall) is opaque
/// bytes here: sessions are about who, when and in which order. `common/codec/MessageCodec.h` puts these on the wire.
#pragma once

#include <chrono>
#include <string>
#include <variant>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/Clock.h"
#include "common/base/Error.h"
#include "common/base/HistoryIds.h"
#include "common/base/Version.h"
#include "common/session/CommittedList.h"

namespace tessera {

/// Channels of one peer, each a connection of its own, so that bulk data never delays a frame.
enum class ChannelKind : std::uint8_t {
    kControl = 0,  ///< barrier, heartbeats, change lists: ordered
    kBulk = 1,     ///< blobs and images
};

enum class PeerRole : std::uint8_t { kHost = 0, kApplication = 1 };

/// One object or one range of ids with its hash; see Aspect::leafHashes.
struct HashEntry {
    std::uint64_t key = 0;
    std::uint64_t hash = 0;
    bool operator==(const HashEntry&) const = default;
};

namespace message {

// ---- both ways -----------------------------------------------------------------------------------------------------

/// Every heartbeat interval from a thread that does not draw. `echo` is the last `sentAtNs` received from the other
/// side and `heldNs` how long it lay here: enough to estimate round trip and clock offset (NTP's on-wire protocol). All
/// zero: a sign of life and nothing else, said by the network thread where the session has been silent.
struct Heartbeat {
    std::int64_t sentAtNs = 0;
    std::int64_t echoNs = 0;
    std::int64_t heldNs = 0;
    bool operator==(const Heartbeat&) const = default;
};

// ---- peer to server ------------------------------------------------------------------------------------------------

/// First message on every connection.
struct Hello {
    std::uint32_t protocol = kProtocolVersion;
    std::uint64_t schema = 0;  ///< hash of the field table
    PeerRole role = PeerRole::kHost;
    ChannelKind channel = ChannelKind::kControl;
    std::string name;              ///< the host's name in the wall, or what an application calls itself
    std::uint64_t token = 0;       ///< bulk channels: the token of the Welcome on the control channel
    std::uint64_t pixelProbe = 0;  ///< hash of a small lit test image; hosts whose pixels differ are named
    bool wantBlobs = true;         ///< applications may follow without bulk data
    bool operator==(const Hello&) const = default;
};
/// The replica stands at `sequence` with all its blobs; the host can enter the barrier.
struct Synced {
    Sequence sequence;
    StateHash stateHash;
    bool operator==(const Synced&) const = default;
};
/// The image of `frame` is complete in memory, not merely "received".
struct Ready {
    FrameNumber frame;
    StateHash stateHash;
    ByteSlice stats;  ///< per tile: see codec FrameCodec
};
/// Image `frame` became the one shown at this instant of the *server's* clock, as the host estimates it.
struct Shown {
    FrameNumber frame;
    std::int64_t shownAtNs = 0;
    bool operator==(const Shown&) const = default;
};
/// All blobs of the BlobNotice with this token are here.
struct BlobsHeld {
    std::uint64_t token = 0;
    bool operator==(const BlobsHeld&) const = default;
};
/// Bulk channel: some bytes of a blob, please. The requester decides how much is under way: that is the flow control.
struct BlobRequest {
    BlobId id;
    std::uint64_t offset = 0;
    std::uint32_t length = 0;
    bool operator==(const BlobRequest&) const = default;
};
struct HashAnswer {
    Sequence sequence;
    bool objects = false;  ///< entries are objects of one leaf, else leaves
    std::vector<HashEntry> entries;
    bool operator==(const HashAnswer&) const = default;
};
/// Bulk channel: the answer to an ImageRequest, one per tile, PNG.
struct TileImage {
    std::uint64_t request = 0;
    FrameNumber frame;
    std::string tile;
    ByteSlice png;
};
/// Anything an application asks for: content in `body` (codec ApplicationCodec).
struct Request {
    std::uint64_t id = 0;
    ByteSlice body;
};

// ---- server to peer ------------------------------------------------------------------------------------------------

struct Welcome {
    Epoch epoch;
    std::uint64_t token = 0;  ///< binds this peer's bulk channel to it
    std::chrono::milliseconds heartbeat{100};
    std::chrono::milliseconds lostAfter{800};
    ByteSlice configuration;  ///< the wall (codec WallCodec)
};
/// The connection is closed after this. `retry`: the same call may go well later.
struct Refused {
    ErrorCode code = ErrorCode::kRefused;
    std::string reason;
    bool retry = false;
    bool operator==(const Refused&) const = default;
};
/// The whole scene: a list that makes it from nothing, with all blobs that it names. A small one comes as it is. Of a
/// large one `list` says only where it leads; it lies in a blob, fetched like any other (codec SnapshotCodec).
struct Snapshot {
    CommittedListPtr list = nothingCommitted();
    BlobInfo content = {};  ///< of no bytes: `list` is whole
    /// Where the scene stands already, with the lists that follow: one snapshot may serve several who come.
    Sequence current = {};
};
/// A committed list off the barrier (joining and late hosts, applications).
struct Changes {
    CommittedListPtr list = nothingCommitted();
};
/// Apply `list` and draw frame `frame`; `payload` holds its view (codec FrameCodec). Hosts hold the list's blobs
/// already where they were announced.
struct Begin {
    FrameNumber frame;
    ByteSlice payload;
    CommittedListPtr list = nothingCommitted();  ///< where it changes nothing it says where the replica stands
};
/// Make image `frame` the one shown.
struct Swap {
    FrameNumber frame;
    bool operator==(const Swap&) const = default;
};
/// A list that needs these blobs will be committed when everybody has them.
struct BlobNotice {
    std::uint64_t token = 0;
    std::vector<BlobInfo> blobs;
    bool operator==(const BlobNotice&) const = default;
};
struct BlobChunk {
    BlobId id;
    std::uint64_t offset = 0;
    std::uint64_t totalBytes = 0;  ///< 0: the server does not have this blob
    ByteSlice bytes;
};
/// Leaf hashes (no leaf) or the object hashes of one leaf, of the replica as it is.
struct HashQuery {
    bool objects = false;
    std::uint64_t leaf = 0;
    bool operator==(const HashQuery&) const = default;
};
/// Send all tile images of the frame that is shown once `frame` or a later one is.
struct ImageRequest {
    std::uint64_t request = 0;
    FrameNumber frame;
    bool operator==(const ImageRequest&) const = default;
};
struct Reply {
    std::uint64_t id = 0;
    ErrorCode code = ErrorCode::kFailed;  ///< only where `error` is not empty
    std::string error;
    ByteSlice body;
};
/// Frame data for subscribers (codec ApplicationCodec).
struct Notice {
    ByteSlice body;
};
/// The show is over; peers finish and exit 0.
struct Over {
    std::string reason;
    bool operator==(const Over&) const = default;
};

}  // namespace message

using Message = std::variant<message::Heartbeat, message::Hello, message::Synced, message::Ready, message::Shown,
                             message::BlobsHeld, message::BlobRequest, message::HashAnswer, message::TileImage,
                             message::Request, message::Welcome, message::Refused, message::Snapshot, message::Changes,
                             message::Begin, message::Swap, message::BlobNotice, message::BlobChunk, message::HashQuery,
                             message::ImageRequest, message::Reply, message::Notice, message::Over>;
/// One message for several peers is one object: it is encoded once.
using MessagePtr = std::shared_ptr<const Message>;

/// The field's name for logs, e.g. "Begin".
[[nodiscard]] std::string_view nameOf(const Message& message);

}  // namespace tessera
