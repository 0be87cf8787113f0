#include "common/codec/MessageCodec.h"

#include <fmt/format.h>

#include <limits>
#include <optional>

#include "common/base/Utf8.h"
#include "common/codec/MessageHead.h"
#include "common/codec/Parts.h"
#include "common/codec/Unpacker.h"

namespace tessera {

namespace {

constexpr std::size_t kMaxMessageHeadBytes = 16 * 1024;
constexpr std::size_t kMaxParts = 3;

using MessageParts = std::vector<ByteSlice>;

static_assert(MessageLimits{}.maxEntries * sizeof(BlobInfo) <= message::kRoomForBlobs);
static_assert(MessageLimits{}.maxEntries * sizeof(HashEntry) + kMaxMessageHeadBytes <=
              message::HashAnswer::kInfo.maxPayload);

// ---- numbers of any type as those of a head: 64 bits

template <typename T>
std::uint64_t toNumber(T value) {
    return static_cast<std::uint64_t>(value);
}
template <typename Tag>
std::uint64_t toNumber(StrongId<Tag> id) {
    return id.value;
}
std::uint64_t toNumber(std::chrono::milliseconds time) {
    return static_cast<std::uint32_t>(time.count());
}

/// Nothing where `number` is no T.
template <typename T>
std::optional<T> fromNumber(std::uint64_t number) {
    if constexpr (std::is_enum_v<T>) {
        if (number > static_cast<std::uint64_t>(lastOf(T{}))) return std::nullopt;
        return static_cast<T>(number);
    } else if constexpr (std::is_same_v<T, bool>) {
        return number != 0;
    } else if constexpr (std::is_same_v<T, std::chrono::milliseconds>) {
        if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
        return T(static_cast<typename T::rep>(number));
    } else if constexpr (std::is_integral_v<T> && sizeof(T) < sizeof number) {
        if (number > std::numeric_limits<T>::max()) return std::nullopt;
        return static_cast<T>(number);
    } else {
        return T(number);
    }
}

// ---- packing

/// Records that go with the message to be encoded, which may not live as long as its bytes.
template <typename Record>
ByteSlice copied(const std::vector<Record>& records) {
    const ByteSpan bytes = recordBytes(records);
    return Bytes(bytes.begin(), bytes.end());
}

template <FieldForm Form, typename M, typename T>
void pack(const MessageField<Form, M, T>& f, const T& value, HeadWriter& head, MessageParts& parts) {
    if constexpr (Form == FieldForm::kVarint) {
        head.varint(f.number, toNumber(value));
    } else if constexpr (Form == FieldForm::kFixed) {
        head.fixed(f.number, toNumber(value));
    } else if constexpr (Form == FieldForm::kText) {
        head.text(f.number, value);
    } else if constexpr (Form == FieldForm::kReason) {
        head.text(f.number, cutUtf8(value, MessageLimits{}.maxTextBytes));
    } else if constexpr (Form == FieldForm::kHash) {
        head.fixed(f.number, value.low);
        head.fixed(f.number + 1, value.high);
    } else if constexpr (Form == FieldForm::kBlob) {
        head.fixed(f.number, value.id.low);
        head.fixed(f.number + 1, value.id.high);
        head.varint(f.number + 2, value.sizeBytes);
    } else if constexpr (Form == FieldForm::kBytes) {
        parts.push_back(value);
    } else if constexpr (Form == FieldForm::kRecords) {
        parts.push_back(copied(value));
    } else {
        static_assert(Form == FieldForm::kList);
        head.varint(f.number, value->sequence.value);
        head.fixed(f.number + 1, value->stateHash.value);
        parts.push_back(value->encoded);  // list and blobs where they lie
        parts.emplace_back(value, recordBytes(value->blobs));
    }
}

// ---- unpacking

constexpr std::size_t partsOf(FieldForm form) {
    if (form == FieldForm::kList) return 2;
    return form == FieldForm::kBytes || form == FieldForm::kRecords ? 1 : 0;
}
template <Described M>
constexpr std::size_t partsOf() {
    std::size_t parts = 0;
    forEachField<M>([&]<FieldForm Form, typename T>(const MessageField<Form, M, T>&) { parts += partsOf(Form); });
    return parts;
}

/// Of one message, field after field.
class MessageUnpacker : public Unpacker {
public:
    MessageUnpacker(ByteSlice whole, HeadReader head, std::vector<ByteSpan> parts, const MessageLimits& limits)
        : Unpacker(std::move(whole), std::move(parts), limits.maxTextBytes),
          head_(head),
          maxEntries_(limits.maxEntries) {}

    template <FieldForm Form, typename M, typename T>
    void unpack(const MessageField<Form, M, T>& f, T& value) {
        if constexpr (Form == FieldForm::kVarint) {
            value = number<T>(head_.varint(f.number));
        } else if constexpr (Form == FieldForm::kFixed) {
            value = number<T>(head_.fixed(f.number));
        } else if constexpr (Form == FieldForm::kText || Form == FieldForm::kReason) {
            value = text(std::string(head_.text(f.number)));
        } else if constexpr (Form == FieldForm::kHash) {
            value = {head_.fixed(f.number), head_.fixed(f.number + 1)};
        } else if constexpr (Form == FieldForm::kBlob) {
            value = {{head_.fixed(f.number), head_.fixed(f.number + 1)}, head_.varint(f.number + 2)};
        } else if constexpr (Form == FieldForm::kBytes) {
            value = bytes(nextPart_++);
        } else if constexpr (Form == FieldForm::kRecords) {
            value = records<typename T::value_type>(nextPart_++, maxEntries_);
        } else {
            static_assert(Form == FieldForm::kList);
            const std::size_t part = std::exchange(nextPart_, nextPart_ + 2);
            value = share(CommittedList{Sequence(head_.varint(f.number)), StateHash(head_.fixed(f.number + 1)),
                                        bytes(part), records<BlobInfo>(part + 1, maxEntries_)});
        }
    }

private:
    template <typename T>
    T number(std::uint64_t value) {
        const std::optional<T> known = fromNumber<T>(value);
        if (!known) refuse(ErrorCode::kBadInput, fmt::format("it holds the unknown value {}", value));
        return known.value_or(T{});
    }

    HeadReader head_;
    std::size_t maxEntries_;
    std::size_t nextPart_ = 0;
};

template <Described M>
Expected<Message> decodeAs(const ByteSlice& payload, const MessageLimits& limits) {
    auto split = splitParts(payload, kMaxMessageHeadBytes, kMaxParts);
    if (!split) return tl::unexpected(split.error());
    const Expected<HeadReader> head = HeadReader::read(split->head);
    if (!head) return tl::unexpected(head.error());
    M message;
    if constexpr (std::is_same_v<M, message::Hello>) {
        // Of a version that is not known only the number is understood for certain.
        message.protocol = static_cast<std::uint32_t>(head->varint(1));
        if (message.protocol < kOldestAskersProtocol || message.protocol > kProtocolVersion) return message;
    }
    MessageUnpacker in(payload, *head, std::move(split->parts), limits);
    in.expectParts(partsOf<M>());
    forEachField<M>([&](const auto& f) { in.unpack(f, message.*f.member); });
    if (in.error()) return tl::unexpected(*in.error());
    return message;
}

using Decode = Expected<Message> (*)(const ByteSlice&, const MessageLimits&);

template <typename Variant>
struct Decoders;
template <Described... M>
struct Decoders<std::variant<M...>> {
    static_assert(((partsOf<M>() <= kMaxParts) && ...));
    static Decode of(std::uint16_t type) {
        Decode found = nullptr;
        ((M::kInfo.number == type ? void(found = &decodeAs<M>) : void()), ...);
        return found;
    }
};

}  // namespace

std::uint16_t wireType(const Message& message) {
    return infoOf(message).number;
}

ByteChain encodeMessage(const Message& message) {
    return std::visit(
        []<Described M>(const M& m) {
            HeadWriter head;
            MessageParts parts;
            forEachField<M>([&](const auto& f) { pack(f, m.*f.member, head, parts); });
            return chainParts(head.bytes(), parts);
        },
        message);
}

Expected<Message> decodeMessage(std::uint16_t type, const ByteSlice& payload, const MessageLimits& limits) {
    const MessageInfo* info = findInfo(type);
    if (info == nullptr) return fail(ErrorCode::kBadInput, fmt::format("a message of unknown type {}", type));
    if (payload.size() > info->maxPayload)
        return fail(ErrorCode::kLimit, fmt::format("a {} with {} bytes; at most {} are allowed", info->name,
                                                   payload.size(), info->maxPayload));
    auto decoded = Decoders<Message>::of(type)(payload, limits);
    if (!decoded) return failWith(fmt::format("a malformed {}", info->name), decoded.error());
    return decoded;
}

std::size_t maxPayloadBytes(std::uint16_t type) {
    const MessageInfo* info = findInfo(type);
    return info ? info->maxPayload : 0;
}

std::size_t maxPayloadBytesFromPeer(std::uint16_t type) {
    const MessageInfo* info = findInfo(type);
    return info && includes(info->from, Party::kPeers) ? info->maxPayload : 0;
}

}  // namespace tessera
