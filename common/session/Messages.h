/// What servers, hosts and applications say to each other. Content (change lists, views, statistics, wall) is opaque
/// bytes here: sessions are about who, when and in which order. `common/codec/MessageCodec.h` puts these on the wire.
///
/// Each message is described beside its members, once: coding, comparing, dispatching and tests follow that. A new one
/// is a struct here, its name in `Message`, its head in proto/session.proto, and an `on` in the session that hears it;
/// without one of these it does not compile, or a test says so.
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
#include "common/input/InputState.h"
#include "common/session/CommittedList.h"
#include "common/session/MessageFields.h"
#include "common/session/SessionToken.h"

namespace tessera {

/// One object or one range of ids with its hash; see Aspect::leafHashes.
struct HashEntry {
    std::uint64_t key = 0;
    std::uint64_t hash = 0;
    bool operator==(const HashEntry&) const = default;
};

/// The last word of each enumeration in a message: what is beyond it is refused.
[[nodiscard]] constexpr PeerRole lastOf(PeerRole) {
    return PeerRole::kApplication;
}
[[nodiscard]] constexpr ChannelKind lastOf(ChannelKind) {
    return ChannelKind::kBulk;
}
[[nodiscard]] constexpr ErrorCode lastOf(ErrorCode) {
    return ErrorCode::kFailed;
}

/// What an application may ask for at once. The library says so before it sends anything.
namespace limits {

/// The list of a proposal: it is checked and applied between two frames.
inline constexpr std::size_t kMaxProposalBytes = std::size_t{64} << 20;
/// All arrays that a proposal brings.
inline constexpr std::size_t kMaxUploadBytes = std::size_t{1} << 30;
/// Of them those that travel with the list: the frame thread copies and hashes them. The others come before it in
/// pieces (Upload).
inline constexpr std::size_t kMaxInlineArrayBytes = std::size_t{1} << 20;
/// A message is moved in memory once more as it passes 1 MiB.
inline constexpr std::size_t kUploadPieceBytes = std::size_t{960} << 10;
/// Any request: a proposal with its small arrays is the largest.
inline constexpr std::size_t kMaxRequestBytes = kMaxProposalBytes + kMaxInlineArrayBytes + (std::size_t{3} << 20);

}  // namespace limits

namespace message {

// Largest payloads. Heads have at most 16 KiB.
inline constexpr std::size_t kMebi = std::size_t{1} << 20;
inline constexpr std::size_t kSmall = 256;
inline constexpr std::size_t kTexts = 16 * 1024 + 64;
inline constexpr std::size_t kRoomForBlobs = 24 * kMebi;

// ---- both ways -----------------------------------------------------------------------------------------------------

/// Every heartbeat interval from a thread that does not draw. `echo` is the last `sentAtNs` received from the other
/// side and `heldNs` how long it lay here: enough to estimate round trip and clock offset (NTP's on-wire protocol). All
/// zero: a sign of life and nothing else, said by the network thread where the session has been silent.
struct Heartbeat {
    std::int64_t sentAtNs = 0;
    std::int64_t echoNs = 0;
    std::int64_t heldNs = 0;

    static constexpr MessageInfo kInfo{
        1, "Heartbeat", Party::kAnybody, Party::kAnybody, OnChannel::kControl, SaidWhen::kAlways, kSmall};
    static constexpr auto fields() {
        return std::tuple(field::fixed(1, "sent_at_ns", &Heartbeat::sentAtNs),
                          field::fixed(2, "echo_ns", &Heartbeat::echoNs),
                          field::fixed(3, "held_ns", &Heartbeat::heldNs));
    }
};

// ---- peer to server ------------------------------------------------------------------------------------------------

/// First message on every connection.
struct Hello {
    std::uint32_t protocol = kProtocolVersion;
    std::uint64_t schema = 0;  ///< hash of the field table
    PeerRole role = PeerRole::kHost;
    ChannelKind channel = ChannelKind::kControl;
    std::string name;              ///< the host's name in the wall, or what an application calls itself
    SessionToken token;            ///< bulk channels: that of the Welcome on the control channel
    std::uint64_t pixelProbe = 0;  ///< hash of a small lit test image; hosts whose pixels differ are named
    bool wantBlobs = true;         ///< applications may follow without bulk data
    bool follows = true;           ///< applications may ask without being sent the scene and its lists
    Epoch seenEpoch;               ///< hosts: the highest in which a server of this wall has welcomed this process
    std::string machine;           ///< hosts: equal where two can reach each other's memory; empty: nobody's neighbour
    std::string board;             ///< and where neighbours find this one's board (client/share)
    std::string access;            ///< control channels: the word that lets it in (AccessToken.h)

    static constexpr MessageInfo kInfo{
        2, "Hello", Party::kPeers, Party::kServer, OnChannel::kBoth, SaidWhen::kFirst, kTexts};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "protocol", &Hello::protocol), field::fixed(2, "schema", &Hello::schema),
                          field::varint(3, "role", &Hello::role), field::varint(4, "channel", &Hello::channel),
                          field::text(5, "name", &Hello::name), field::fixed(7, "pixel_probe", &Hello::pixelProbe),
                          field::varint(8, "want_blobs", &Hello::wantBlobs),
                          field::varint(9, "follows", &Hello::follows), field::hash(10, "token", &Hello::token),
                          field::fixed(12, "seen_epoch", &Hello::seenEpoch),
                          field::text(13, "machine", &Hello::machine), field::text(14, "board", &Hello::board),
                          field::text(15, "access", &Hello::access));
    }
};
/// The replica stands at `sequence` with all its blobs; a host can enter the barrier.
struct Synced {
    Sequence sequence;
    StateHash stateHash;

    static constexpr MessageInfo kInfo{
        3, "Synced", Party::kPeers, Party::kServer, OnChannel::kControl, SaidWhen::kLater, kSmall};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "sequence", &Synced::sequence),
                          field::fixed(2, "state_hash", &Synced::stateHash));
    }
};
/// The image of `frame` is complete in memory, not merely "received".
struct Ready {
    FrameNumber frame;
    StateHash stateHash;
    ByteSlice stats;  ///< per tile: see codec FrameCodec

    static constexpr MessageInfo kInfo{
        4, "Ready", Party::kHosts, Party::kServer, OnChannel::kControl, SaidWhen::kLater, kMebi};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "frame", &Ready::frame), field::fixed(2, "state_hash", &Ready::stateHash),
                          field::bytes("statistics", &Ready::stats));
    }
};
/// Image `frame` became the one shown at this instant of the *server's* clock, as the host estimates it.
struct Shown {
    FrameNumber frame;
    std::int64_t shownAtNs = 0;

    static constexpr MessageInfo kInfo{
        5, "Shown", Party::kHosts, Party::kServer, OnChannel::kControl, SaidWhen::kLater, kSmall};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "frame", &Shown::frame), field::fixed(2, "shown_at_ns", &Shown::shownAtNs));
    }
};
/// All blobs of the BlobNotice with this token are here.
struct BlobsHeld {
    std::uint64_t token = 0;

    static constexpr MessageInfo kInfo{
        6, "BlobsHeld", Party::kHosts, Party::kServer, OnChannel::kControl, SaidWhen::kLater, kSmall};
    static constexpr auto fields() { return std::tuple(field::fixed(1, "token", &BlobsHeld::token)); }
};
/// Some bytes of a blob, please. The requester decides how much is under way: that is the flow control.
struct BlobRequest {
    BlobId id;
    std::uint64_t offset = 0;
    std::uint32_t length = 0;

    static constexpr MessageInfo kInfo{
        7, "BlobRequest", Party::kPeers, Party::kServer, OnChannel::kBulk, SaidWhen::kLater, kSmall};
    static constexpr auto fields() {
        return std::tuple(field::hash(1, "id", &BlobRequest::id), field::varint(3, "offset", &BlobRequest::offset),
                          field::varint(4, "length", &BlobRequest::length));
    }
};
struct HashAnswer {
    Sequence sequence;
    bool objects = false;  ///< entries are objects of one leaf, else leaves
    std::vector<HashEntry> entries;

    static constexpr MessageInfo kInfo{
        8, "HashAnswer", Party::kHosts, Party::kServer, OnChannel::kControl, SaidWhen::kLater, 17 * kMebi};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "sequence", &HashAnswer::sequence),
                          field::varint(2, "objects", &HashAnswer::objects),
                          field::records("entries", &HashAnswer::entries));
    }
};
/// The answer to an ImageRequest, one per tile: PNG, or JPEG where it was to be shrunk. Of no bytes where the host
/// draws nothing, or has drawn nothing else since the last one.
struct TileImage {
    std::uint64_t request = 0;
    FrameNumber frame;
    std::string tile;
    bool same = false;  ///< as the last one with the same `shrink`
    ByteSlice picture;

    static constexpr MessageInfo kInfo{
        9, "TileImage", Party::kHosts, Party::kServer, OnChannel::kBulk, SaidWhen::kLater, 256 * kMebi};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "request", &TileImage::request),
                          field::varint(2, "frame", &TileImage::frame), field::text(3, "tile", &TileImage::tile),
                          field::varint(4, "same", &TileImage::same), field::bytes("picture", &TileImage::picture));
    }
};
/// Anything an application asks for: content in `body` (codec ApplicationCodec).
struct Request {
    std::uint64_t id = 0;
    ByteSlice body;
    std::string from = {};  ///< the address for which the server's own door asks; of others nobody looks at it

    static constexpr MessageInfo kInfo{10,
                                       "Request",
                                       Party::kApplications,
                                       Party::kServer,
                                       OnChannel::kControl,
                                       SaidWhen::kLater,
                                       limits::kMaxRequestBytes};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "id", &Request::id), field::text(2, "from", &Request::from),
                          field::bytes("body", &Request::body));
    }
};

/// Arrays of the next proposal, in pieces: whoever puts them together does so while frames go by.
struct Upload {
    std::vector<BlobInfo> blobs;  ///< that begin behind what has come of earlier ones
    ByteSlice bytes;              ///< of these and of earlier ones, in their order

    static constexpr MessageInfo kInfo{
        26, "Upload", Party::kApplications, Party::kServer, OnChannel::kControl, SaidWhen::kLater, 2 * kMebi};
    static constexpr auto fields() {
        return std::tuple(field::records("blobs", &Upload::blobs), field::bytes("bytes", &Upload::bytes));
    }
};

/// What people do at this host's windows: whole states of those that have changed. One that is left out costs nothing.
struct Input {
    std::vector<InputState> states;

    static constexpr MessageInfo kInfo{
        25, "Input", Party::kHosts, Party::kServer, OnChannel::kControl, SaidWhen::kLater, kTexts};
    static constexpr auto fields() { return std::tuple(field::records("states", &Input::states)); }
};

// ---- server to peer ------------------------------------------------------------------------------------------------

struct Welcome {
    Epoch epoch;
    SessionToken token;  ///< binds this peer's bulk channel to it
    std::chrono::milliseconds heartbeat{100};
    std::chrono::milliseconds lostAfter{800};
    ByteSlice configuration;  ///< the wall (codec WallCodec)

    static constexpr MessageInfo kInfo{
        11, "Welcome", Party::kServer, Party::kPeers, OnChannel::kControl, SaidWhen::kFirst, 65 * kMebi};
    static constexpr auto fields() {
        return std::tuple(
            field::fixed(1, "epoch", &Welcome::epoch), field::varint(3, "heartbeat_ms", &Welcome::heartbeat),
            field::varint(4, "lost_after_ms", &Welcome::lostAfter), field::hash(5, "token", &Welcome::token),
            field::bytes("configuration", &Welcome::configuration));
    }
};
/// The connection is closed after this. `retry`: the same call may go well later.
struct Refused {
    ErrorCode code = ErrorCode::kRefused;
    std::string reason;
    bool retry = false;

    static constexpr MessageInfo kInfo{
        12, "Refused", Party::kServer, Party::kPeers, OnChannel::kBoth, SaidWhen::kAlways, kTexts};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "code", &Refused::code), field::reason(2, "reason", &Refused::reason),
                          field::varint(3, "retry", &Refused::retry));
    }
};
/// The whole scene: a list that makes it from nothing, with all blobs that it names. A small one comes as it is. Of a
/// large one `list` says only where it leads; it lies in a blob, fetched like any other (codec SnapshotCodec).
struct Snapshot {
    CommittedListPtr list = nothingCommitted();
    BlobInfo content = {};  ///< of no bytes: `list` is whole
    /// Where the scene stands already, with the lists that follow: one snapshot may serve several who come.
    Sequence current = {};

    static constexpr MessageInfo kInfo{13,
                                       "Snapshot",
                                       Party::kServer,
                                       Party::kPeers,
                                       OnChannel::kControl,
                                       SaidWhen::kLater,
                                       257 * kMebi + kRoomForBlobs};
    static constexpr auto fields() {
        return std::tuple(field::list(1, &Snapshot::list), field::blob(3, "content", &Snapshot::content),
                          field::varint(6, "current", &Snapshot::current));
    }
};
/// A committed list off the barrier (joining and late hosts, applications).
struct Changes {
    CommittedListPtr list = nothingCommitted();

    static constexpr MessageInfo kInfo{14,
                                       "Changes",
                                       Party::kServer,
                                       Party::kPeers,
                                       OnChannel::kControl,
                                       SaidWhen::kLater,
                                       257 * kMebi + kRoomForBlobs};
    static constexpr auto fields() { return std::tuple(field::list(1, &Changes::list)); }
};
/// Apply `list` and draw frame `frame`; `payload` holds its view (codec FrameCodec). Hosts hold the list's blobs
/// already where they were announced.
struct Begin {
    FrameNumber frame;
    ByteSlice payload;
    CommittedListPtr list = nothingCommitted();  ///< where it changes nothing it says where the replica stands

    static constexpr MessageInfo kInfo{
        15, "Begin", Party::kServer, Party::kHosts, OnChannel::kControl, SaidWhen::kLater, 257 * kMebi + kRoomForBlobs};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "frame", &Begin::frame), field::bytes("payload", &Begin::payload),
                          field::list(2, &Begin::list));
    }
};
/// Make image `frame` the one shown.
struct Swap {
    FrameNumber frame;

    static constexpr MessageInfo kInfo{
        16, "Swap", Party::kServer, Party::kHosts, OnChannel::kControl, SaidWhen::kLater, kSmall};
    static constexpr auto fields() { return std::tuple(field::varint(1, "frame", &Swap::frame)); }
};
/// A list that needs these blobs will be committed when everybody has them.
struct BlobNotice {
    std::uint64_t token = 0;
    std::vector<BlobInfo> blobs;

    static constexpr MessageInfo kInfo{
        17, "BlobNotice", Party::kServer, Party::kHosts, OnChannel::kControl, SaidWhen::kLater, kMebi + kRoomForBlobs};
    static constexpr auto fields() {
        return std::tuple(field::fixed(1, "token", &BlobNotice::token), field::records("blobs", &BlobNotice::blobs));
    }
};
struct BlobChunk {
    BlobId id;
    std::uint64_t offset = 0;
    std::uint64_t totalBytes = 0;  ///< 0: the server does not have this blob
    ByteSlice bytes;

    static constexpr MessageInfo kInfo{
        18, "BlobChunk", Party::kServer, Party::kPeers, OnChannel::kBulk, SaidWhen::kLater, 16 * kMebi};
    static constexpr auto fields() {
        return std::tuple(field::hash(1, "id", &BlobChunk::id), field::varint(3, "offset", &BlobChunk::offset),
                          field::varint(4, "total_bytes", &BlobChunk::totalBytes),
                          field::bytes("bytes", &BlobChunk::bytes));
    }
};
/// Leaf hashes (no leaf) or the object hashes of one leaf, of the replica as it is.
struct HashQuery {
    bool objects = false;
    std::uint64_t leaf = 0;

    static constexpr MessageInfo kInfo{
        19, "HashQuery", Party::kServer, Party::kHosts, OnChannel::kControl, SaidWhen::kLater, kSmall};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "objects", &HashQuery::objects), field::varint(2, "leaf", &HashQuery::leaf));
    }
};
/// Send all tile images of the frame that is shown once `frame` or a later one is.
struct ImageRequest {
    std::uint64_t request = 0;
    FrameNumber frame;
    std::uint32_t shrink = 0;  ///< each pixel is the mean of so many, each way, as JPEG; 0: all pixels, as PNG
    bool news = false;         ///< of tiles that show what was sent with this `shrink` last only that is said

    static constexpr MessageInfo kInfo{
        20, "ImageRequest", Party::kServer, Party::kHosts, OnChannel::kControl, SaidWhen::kLater, kSmall};
    static constexpr auto fields() {
        return std::tuple(
            field::varint(1, "request", &ImageRequest::request), field::varint(2, "frame", &ImageRequest::frame),
            field::varint(3, "shrink", &ImageRequest::shrink), field::varint(4, "news", &ImageRequest::news));
    }
};
struct Reply {
    std::uint64_t id = 0;
    ErrorCode code = ErrorCode::kFailed;  ///< only where `error` is not empty
    std::string error;
    ByteSlice body;

    static constexpr MessageInfo kInfo{
        21, "Reply", Party::kServer, Party::kApplications, OnChannel::kControl, SaidWhen::kLater, 257 * kMebi};
    static constexpr auto fields() {
        return std::tuple(field::varint(1, "id", &Reply::id), field::varint(2, "code", &Reply::code),
                          field::reason(3, "error", &Reply::error), field::bytes("body", &Reply::body));
    }
};
/// Frame data for subscribers (codec ApplicationCodec).
struct Notice {
    ByteSlice body;

    static constexpr MessageInfo kInfo{
        22, "Notice", Party::kServer, Party::kApplications, OnChannel::kControl, SaidWhen::kLater, 16 * kMebi};
    static constexpr auto fields() { return std::tuple(field::bytes("body", &Notice::body)); }
};
/// The show is over; peers finish and exit 0.
struct Over {
    std::string reason;

    static constexpr MessageInfo kInfo{
        23, "Over", Party::kServer, Party::kPeers, OnChannel::kBoth, SaidWhen::kAlways, kTexts};
    static constexpr auto fields() { return std::tuple(field::reason(1, "reason", &Over::reason)); }
};

/// Hosts on the same machine as the one that is told, all of them: "HOST BOARD" a line, as their Hellos said it. Said
/// when that has changed.
struct Neighbours {
    std::string boards;

    static constexpr MessageInfo kInfo{
        24, "Neighbours", Party::kServer, Party::kHosts, OnChannel::kControl, SaidWhen::kLater, kTexts};
    static constexpr auto fields() { return std::tuple(field::text(1, "boards", &Neighbours::boards)); }
};

template <Described M>
[[nodiscard]] bool operator==(const M& a, const M& b) {
    return sameFields(a, b);
}

}  // namespace message

using Message =
    std::variant<message::Heartbeat, message::Hello, message::Synced, message::Ready, message::Shown,
                 message::BlobsHeld, message::BlobRequest, message::HashAnswer, message::TileImage, message::Request,
                 message::Welcome, message::Refused, message::Snapshot, message::Changes, message::Begin, message::Swap,
                 message::BlobNotice, message::BlobChunk, message::HashQuery, message::ImageRequest, message::Reply,
                 message::Notice, message::Over, message::Neighbours, message::Input, message::Upload>;
/// One message for several peers is one object: it is encoded once.
using MessagePtr = std::shared_ptr<const Message>;

[[nodiscard]] inline const MessageInfo& infoOf(const Message& message) {
    return std::visit([]<Described M>(const M&) -> const MessageInfo& { return M::kInfo; }, message);
}
/// Null for a number that no message has.
[[nodiscard]] const MessageInfo* findInfo(std::uint16_t number);
/// For logs, e.g. "Begin".
[[nodiscard]] inline std::string_view nameOf(const Message& message) {
    return infoOf(message).name;
}

}  // namespace tessera
