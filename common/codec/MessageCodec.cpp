#include "common/codec/MessageCodec.h"

#include <fmt/format.h>

#include <array>

#include "common/base/Utf8.h"
#include "common/codec/Parts.h"
#include "common/codec/Unpacker.h"
#include "proto/session.pb.h"

namespace tessera {

namespace {

namespace pb = proto::session;

constexpr std::size_t kMaxHeadBytes = 16 * 1024;
constexpr std::size_t kMaxParts = 3;
constexpr std::size_t kSmall = 256;
constexpr std::size_t kText = kMaxHeadBytes + 64;
constexpr std::size_t kMebi = std::size_t{1} << 20;
constexpr std::size_t kRoomForBlobs = 24 * kMebi;

/// Number, largest payload and direction of each message on the wire. Numbers are never reused.
template <typename M>
struct Wire;
template <std::uint16_t Type, std::size_t MaxPayload, bool FromPeer, typename ProtoHead>
struct WireAs {
    static constexpr std::uint16_t kType = Type;
    static constexpr std::size_t kMaxPayload = MaxPayload;
    static constexpr bool kFromPeer = FromPeer;
    using Head = ProtoHead;
};
// clang-format off: a table
template <>
struct Wire<message::Heartbeat> : WireAs<1, kSmall, true, pb::Heartbeat> {};
template <>
struct Wire<message::Hello> : WireAs<2, kText, true, pb::Hello> {};
template <>
struct Wire<message::Synced> : WireAs<3, kSmall, true, pb::Synced> {};
template <>
struct Wire<message::Ready> : WireAs<4, kMebi, true, pb::Ready> {};
template <>
struct Wire<message::Shown> : WireAs<5, kSmall, true, pb::Shown> {};
template <>
struct Wire<message::BlobsHeld> : WireAs<6, kSmall, true, pb::BlobsHeld> {};
template <>
struct Wire<message::BlobRequest> : WireAs<7, kSmall, true, pb::BlobRequest> {};
template <>
struct Wire<message::HashAnswer> : WireAs<8, 17 * kMebi, true, pb::HashAnswer> {};
template <>
struct Wire<message::TileImage> : WireAs<9, 256 * kMebi, true, pb::TileImage> {};
template <>
struct Wire<message::Request> : WireAs<10, 256 * kMebi, true, pb::Request> {};
template <>
struct Wire<message::Welcome> : WireAs<11, 4 * kMebi, false, pb::Welcome> {};
template <>
struct Wire<message::Refused> : WireAs<12, kText, false, pb::Refused> {};
template <>
struct Wire<message::Snapshot> : WireAs<13, 257 * kMebi + kRoomForBlobs, false, pb::Snapshot> {};
template <>
struct Wire<message::Changes> : WireAs<14, 257 * kMebi + kRoomForBlobs, false, pb::Changes> {};
template <>
struct Wire<message::Begin> : WireAs<15, 257 * kMebi + kRoomForBlobs, false, pb::Begin> {};
template <>
struct Wire<message::Swap> : WireAs<16, kSmall, false, pb::SwapFrame> {};
template <>
struct Wire<message::BlobNotice> : WireAs<17, kMebi + kRoomForBlobs, false, pb::BlobNotice> {};
template <>
struct Wire<message::BlobChunk> : WireAs<18, 16 * kMebi, false, pb::BlobChunk> {};
template <>
struct Wire<message::HashQuery> : WireAs<19, kSmall, false, pb::HashQuery> {};
template <>
struct Wire<message::ImageRequest> : WireAs<20, kSmall, false, pb::ImageRequest> {};
template <>
struct Wire<message::Reply> : WireAs<21, 257 * kMebi, false, pb::Reply> {};
template <>
struct Wire<message::Notice> : WireAs<22, 16 * kMebi, false, pb::Notice> {};
template <>
struct Wire<message::Over> : WireAs<23, kText, false, pb::Over> {};
// clang-format on

using Parts = std::vector<ByteSlice>;

/// Records that go with the message to be encoded, which may not live as long as its bytes.
template <typename Record>
ByteSlice copied(const std::vector<Record>& records) {
    const ByteSpan bytes = recordBytes(records);
    return Bytes(bytes.begin(), bytes.end());
}
/// List and blobs of an envelope, where they lie.
template <typename Head>
void packList(const CommittedListPtr& list, Head& head, Parts& parts) {
    head.set_sequence(list->sequence.value);
    head.set_state_hash(list->stateHash.value);
    parts.push_back(list->encoded);
    parts.emplace_back(list, recordBytes(list->blobs));
}
std::string reasonText(const std::string& text) {
    return std::string(cutUtf8(text, MessageLimits{}.maxTextBytes));
}

// ---- packing

void pack(const message::Heartbeat& m, pb::Heartbeat& head, Parts&) {
    head.set_sent_at_ns(m.sentAtNs);
    head.set_echo_ns(m.echoNs);
    head.set_held_ns(m.heldNs);
}
void pack(const message::Hello& m, pb::Hello& head, Parts&) {
    head.set_protocol(m.protocol);
    head.set_schema(m.schema);
    head.set_role(static_cast<std::uint32_t>(m.role));
    head.set_channel(static_cast<std::uint32_t>(m.channel));
    head.set_name(m.name);
    head.set_token(m.token);
    head.set_pixel_probe(m.pixelProbe);
    head.set_want_blobs(m.wantBlobs);
}
void pack(const message::Synced& m, pb::Synced& head, Parts&) {
    head.set_sequence(m.sequence.value);
    head.set_state_hash(m.stateHash.value);
}
void pack(const message::Ready& m, pb::Ready& head, Parts& parts) {
    head.set_frame(m.frame.value);
    head.set_state_hash(m.stateHash.value);
    parts = {m.stats};
}
void pack(const message::Shown& m, pb::Shown& head, Parts&) {
    head.set_frame(m.frame.value);
    head.set_shown_at_ns(m.shownAtNs);
}
void pack(const message::BlobsHeld& m, pb::BlobsHeld& head, Parts&) {
    head.set_token(m.token);
}
void pack(const message::BlobRequest& m, pb::BlobRequest& head, Parts&) {
    head.set_id_low(m.id.low);
    head.set_id_high(m.id.high);
    head.set_offset(m.offset);
    head.set_length(m.length);
}
void pack(const message::HashAnswer& m, pb::HashAnswer& head, Parts& parts) {
    head.set_sequence(m.sequence.value);
    head.set_objects(m.objects);
    parts = {copied(m.entries)};
}
void pack(const message::TileImage& m, pb::TileImage& head, Parts& parts) {
    head.set_request(m.request);
    head.set_frame(m.frame.value);
    head.set_tile(m.tile);
    parts = {m.png};
}
void pack(const message::Request& m, pb::Request& head, Parts& parts) {
    head.set_id(m.id);
    parts = {m.body};
}
void pack(const message::Welcome& m, pb::Welcome& head, Parts& parts) {
    head.set_epoch(m.epoch.value);
    head.set_token(m.token);
    head.set_heartbeat_ms(static_cast<std::uint32_t>(m.heartbeat.count()));
    head.set_lost_after_ms(static_cast<std::uint32_t>(m.lostAfter.count()));
    parts = {m.configuration};
}
void pack(const message::Refused& m, pb::Refused& head, Parts&) {
    head.set_code(static_cast<std::uint32_t>(m.code));
    head.set_reason(reasonText(m.reason));
    head.set_retry(m.retry);
}
void pack(const message::Snapshot& m, pb::Snapshot& head, Parts& parts) {
    packList(m.list, head, parts);
    head.set_content_low(m.content.id.low);
    head.set_content_high(m.content.id.high);
    head.set_content_bytes(m.content.sizeBytes);
    head.set_current(m.current.value);
}
void pack(const message::Changes& m, pb::Changes& head, Parts& parts) {
    packList(m.list, head, parts);
}
void pack(const message::Begin& m, pb::Begin& head, Parts& parts) {
    head.set_frame(m.frame.value);
    parts = {m.payload};
    packList(m.list, head, parts);
}
void pack(const message::Swap& m, pb::SwapFrame& head, Parts&) {
    head.set_frame(m.frame.value);
}
void pack(const message::BlobNotice& m, pb::BlobNotice& head, Parts& parts) {
    head.set_token(m.token);
    parts = {copied(m.blobs)};
}
void pack(const message::BlobChunk& m, pb::BlobChunk& head, Parts& parts) {
    head.set_id_low(m.id.low);
    head.set_id_high(m.id.high);
    head.set_offset(m.offset);
    head.set_total_bytes(m.totalBytes);
    parts = {m.bytes};
}
void pack(const message::HashQuery& m, pb::HashQuery& head, Parts&) {
    head.set_objects(m.objects);
    head.set_leaf(m.leaf);
}
void pack(const message::ImageRequest& m, pb::ImageRequest& head, Parts&) {
    head.set_request(m.request);
    head.set_frame(m.frame.value);
}
void pack(const message::Reply& m, pb::Reply& head, Parts& parts) {
    head.set_id(m.id);
    head.set_code(static_cast<std::uint32_t>(m.code));
    head.set_error(reasonText(m.error));
    parts = {m.body};
}
void pack(const message::Notice& m, pb::Notice&, Parts& parts) {
    parts = {m.body};
}
void pack(const message::Over& m, pb::Over& head, Parts&) {
    head.set_reason(reasonText(m.reason));
}

// ---- unpacking

/// With the limits of session messages.
class MessageUnpacker : public Unpacker {
public:
    MessageUnpacker(ByteSlice whole, std::vector<ByteSpan> parts, const MessageLimits& limits)
        : Unpacker(std::move(whole), std::move(parts), limits.maxTextBytes), maxEntries_(limits.maxEntries) {}

    template <typename Record>
    std::vector<Record> records(std::size_t part) {
        return Unpacker::records<Record>(part, maxEntries_);
    }
    /// An envelope whose list is part `part` and whose blobs are the one behind.
    template <typename Head>
    CommittedListPtr list(const Head& head, std::size_t part) {
        return share(CommittedList{Sequence(head.sequence()), StateHash(head.state_hash()), bytes(part),
                                   records<BlobInfo>(part + 1)});
    }

private:
    std::size_t maxEntries_;
};

constexpr ErrorCode kLastErrorCode = ErrorCode::kFailed;

void unpack(message::Heartbeat& m, const pb::Heartbeat& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {head.sent_at_ns(), head.echo_ns(), head.held_ns()};
}
void unpack(message::Hello& m, const pb::Hello& head, MessageUnpacker& in) {
    m.protocol = head.protocol();
    // Of another version only the number is understood for certain.
    if (m.protocol != kProtocolVersion) return;
    in.expectParts(0);
    m.schema = head.schema();
    m.role = in.enumeration(head.role(), PeerRole::kApplication);
    m.channel = in.enumeration(head.channel(), ChannelKind::kBulk);
    m.name = in.text(head.name());
    m.token = head.token();
    m.pixelProbe = head.pixel_probe();
    m.wantBlobs = head.want_blobs();
}
void unpack(message::Synced& m, const pb::Synced& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {Sequence(head.sequence()), StateHash(head.state_hash())};
}
void unpack(message::Ready& m, const pb::Ready& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {FrameNumber(head.frame()), StateHash(head.state_hash()), in.bytes(0)};
}
void unpack(message::Shown& m, const pb::Shown& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {FrameNumber(head.frame()), head.shown_at_ns()};
}
void unpack(message::BlobsHeld& m, const pb::BlobsHeld& head, MessageUnpacker& in) {
    in.expectParts(0);
    m.token = head.token();
}
void unpack(message::BlobRequest& m, const pb::BlobRequest& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {BlobId{head.id_low(), head.id_high()}, head.offset(), head.length()};
}
void unpack(message::HashAnswer& m, const pb::HashAnswer& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {Sequence(head.sequence()), head.objects(), in.records<HashEntry>(0)};
}
void unpack(message::TileImage& m, const pb::TileImage& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {head.request(), FrameNumber(head.frame()), in.text(head.tile()), in.bytes(0)};
}
void unpack(message::Request& m, const pb::Request& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {head.id(), in.bytes(0)};
}
void unpack(message::Welcome& m, const pb::Welcome& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {Epoch(head.epoch()), head.token(), std::chrono::milliseconds(head.heartbeat_ms()),
         std::chrono::milliseconds(head.lost_after_ms()), in.bytes(0)};
}
void unpack(message::Refused& m, const pb::Refused& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {in.enumeration(head.code(), kLastErrorCode), in.text(head.reason()), head.retry()};
}
void unpack(message::Snapshot& m, const pb::Snapshot& head, MessageUnpacker& in) {
    in.expectParts(2);
    m = {in.list(head, 0), {{head.content_low(), head.content_high()}, head.content_bytes()}, Sequence(head.current())};
}
void unpack(message::Changes& m, const pb::Changes& head, MessageUnpacker& in) {
    in.expectParts(2);
    m.list = in.list(head, 0);
}
void unpack(message::Begin& m, const pb::Begin& head, MessageUnpacker& in) {
    in.expectParts(3);
    m = {FrameNumber(head.frame()), in.bytes(0), in.list(head, 1)};
}
void unpack(message::Swap& m, const pb::SwapFrame& head, MessageUnpacker& in) {
    in.expectParts(0);
    m.frame = FrameNumber(head.frame());
}
void unpack(message::BlobNotice& m, const pb::BlobNotice& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {head.token(), in.records<BlobInfo>(0)};
}
void unpack(message::BlobChunk& m, const pb::BlobChunk& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {BlobId{head.id_low(), head.id_high()}, head.offset(), head.total_bytes(), in.bytes(0)};
}
void unpack(message::HashQuery& m, const pb::HashQuery& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {head.objects(), head.leaf()};
}
void unpack(message::ImageRequest& m, const pb::ImageRequest& head, MessageUnpacker& in) {
    in.expectParts(0);
    m = {head.request(), FrameNumber(head.frame())};
}
void unpack(message::Reply& m, const pb::Reply& head, MessageUnpacker& in) {
    in.expectParts(1);
    m = {head.id(), in.enumeration(head.code(), kLastErrorCode), in.text(head.error()), in.bytes(0)};
}
void unpack(message::Notice& m, const pb::Notice&, MessageUnpacker& in) {
    in.expectParts(1);
    m.body = in.bytes(0);
}
void unpack(message::Over& m, const pb::Over& head, MessageUnpacker& in) {
    in.expectParts(0);
    m.reason = in.text(head.reason());
}

// ---- the table of types

template <typename M>
Expected<Message> decodeAs(const ByteSlice& payload, const MessageLimits& limits) {
    auto split = splitParts(payload, kMaxHeadBytes, kMaxParts);
    if (!split) return tl::unexpected(split.error());
    typename Wire<M>::Head head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())))
        return fail(ErrorCode::kBadInput, "its head is no protobuf message");
    MessageUnpacker in(payload, std::move(split->parts), limits);
    M message;
    unpack(message, head, in);
    if (in.error()) return tl::unexpected(*in.error());
    return message;
}

struct TypeEntry {
    std::uint16_t type = 0;
    std::size_t maxPayload = 0;
    bool fromPeer = false;
    Expected<Message> (*decode)(const ByteSlice&, const MessageLimits&) = nullptr;
};

template <typename Variant>
struct TypeTable;
template <typename... M>
struct TypeTable<std::variant<M...>> {
    static constexpr std::array<TypeEntry, sizeof...(M)> kEntries{
        TypeEntry{Wire<M>::kType, Wire<M>::kMaxPayload, Wire<M>::kFromPeer, &decodeAs<M>}...};
};

const TypeEntry* findEntry(std::uint16_t type) {
    for (const TypeEntry& entry : TypeTable<Message>::kEntries)
        if (entry.type == type) return &entry;
    return nullptr;
}

}  // namespace

std::uint16_t wireType(const Message& message) {
    return std::visit([]<typename M>(const M&) { return Wire<M>::kType; }, message);
}

ByteChain encodeMessage(const Message& message) {
    return std::visit(
        []<typename M>(const M& m) {
            typename Wire<M>::Head head;
            Parts parts;
            pack(m, head, parts);
            return chainParts(head, parts);
        },
        message);
}

Expected<Message> decodeMessage(std::uint16_t type, const ByteSlice& payload, const MessageLimits& limits) {
    const TypeEntry* entry = findEntry(type);
    if (entry == nullptr) return fail(ErrorCode::kBadInput, fmt::format("a message of unknown type {}", type));
    if (payload.size() > entry->maxPayload)
        return fail(ErrorCode::kLimit, fmt::format("a message of type {} with {} bytes; at most {} are allowed", type,
                                                   payload.size(), entry->maxPayload));
    auto decoded = entry->decode(payload, limits);
    if (!decoded) return failWith(fmt::format("a malformed message of type {}", type), decoded.error());
    return decoded;
}

std::size_t maxPayloadBytes(std::uint16_t type) {
    const TypeEntry* entry = findEntry(type);
    return entry ? entry->maxPayload : 0;
}

std::size_t maxPayloadBytesFromPeer(std::uint16_t type) {
    const TypeEntry* entry = findEntry(type);
    return entry && entry->fromPeer ? entry->maxPayload : 0;
}

}  // namespace tessera
