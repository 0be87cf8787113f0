/// The words in which a message is described: its number, who says it to whom on which channel, and its fields. Coding,
/// comparing, tests and fuzzers follow the description; `Messages.h` has one beside each message.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/base/Hash.h"
#include "common/session/CommittedList.h"

namespace tessera {

/// Channels of one peer, each a connection of its own, so that bulk data never delays a frame.
enum class ChannelKind : std::uint8_t {
    kControl = 0,  ///< barrier, heartbeats, change lists: ordered
    kBulk = 1,     ///< blobs and images
};
enum class PeerRole : std::uint8_t { kHost = 0, kApplication = 1 };

/// Who says a message, or who hears it.
enum class Party : std::uint8_t { kServer = 1, kHosts = 2, kApplications = 4, kPeers = 6, kAnybody = 7 };
[[nodiscard]] constexpr bool includes(Party many, Party one) {
    return (static_cast<unsigned>(many) & static_cast<unsigned>(one)) != 0;
}
[[nodiscard]] constexpr Party partyOf(PeerRole role) {
    return role == PeerRole::kHost ? Party::kHosts : Party::kApplications;
}

enum class OnChannel : std::uint8_t { kControl = 1, kBulk = 2, kBoth = 3 };
[[nodiscard]] constexpr bool includes(OnChannel channels, ChannelKind one) {
    return (static_cast<unsigned>(channels) & (one == ChannelKind::kControl ? 1u : 2u)) != 0;
}

enum class SaidWhen : std::uint8_t {
    kFirst,  ///< the first word of either side: Hello, Welcome
    kLater,  ///< after that
    kAlways,
};

struct MessageInfo {
    std::uint16_t number = 0;  ///< in a net frame's header; never reused, 0 never used
    std::string_view name;     ///< for logs
    Party from{};
    Party to{};
    OnChannel on{};
    SaidWhen when{};
    std::size_t maxPayload = 0;  ///< bytes; known before memory is taken

    /// Whether `speaker` may say it to `hearer` there, at some time.
    [[nodiscard]] constexpr bool goes(Party speaker, Party hearer, ChannelKind channel) const {
        return includes(from, speaker) && includes(to, hearer) && includes(on, channel);
    }
};

/// How a field stands in a message: numbers and short texts in its head, which is a protobuf message
/// (proto/session.proto), bulk as a part behind it (common/codec/Parts.h).
enum class FieldForm : std::uint8_t {
    kVarint,   ///< small numbers, flags, words
    kFixed,    ///< 8 bytes: hashes, times, tokens
    kText,     ///< refused where it is longer than allowed
    kReason,   ///< a text for people: cut where it is longer than allowed
    kHash,     ///< 16 bytes as two fixed numbers, low and high
    kBlob,     ///< a blob's name, as a hash, and size
    kBytes,    ///< a part
    kRecords,  ///< a part: plain records one behind the other
    kList,     ///< an envelope: sequence and hash in the head, the list and its blobs as two parts
};

/// Numbers that a field takes in the head.
[[nodiscard]] constexpr int headFieldsOf(FieldForm form) {
    if (form == FieldForm::kBytes || form == FieldForm::kRecords) return 0;
    if (form == FieldForm::kBlob) return 3;
    return form == FieldForm::kHash || form == FieldForm::kList ? 2 : 1;
}
/// Beyond it a protobuf tag takes a second byte.
inline constexpr int kMostHeadFields = 15;

/// One member of message M. `number` is that of its first head field, ascending within a message and never reused;
/// parts have none.
template <FieldForm Form, typename M, typename T>
struct MessageField {
    std::uint8_t number = 0;
    std::string_view name;  ///< as the schema has it
    T M::*member = nullptr;
};

namespace message::field {
template <typename M, typename T>
constexpr MessageField<FieldForm::kVarint, M, T> varint(std::uint8_t number, std::string_view name, T M::*member) {
    return {number, name, member};
}
template <typename M, typename T>
constexpr MessageField<FieldForm::kFixed, M, T> fixed(std::uint8_t number, std::string_view name, T M::*member) {
    return {number, name, member};
}
template <typename M>
constexpr MessageField<FieldForm::kText, M, std::string> text(std::uint8_t number, std::string_view name,
                                                              std::string M::*member) {
    return {number, name, member};
}
template <typename M>
constexpr MessageField<FieldForm::kReason, M, std::string> reason(std::uint8_t number, std::string_view name,
                                                                  std::string M::*member) {
    return {number, name, member};
}
/// Of anything that has 16 bytes as `low` and `high`.
template <typename M, typename T>
constexpr MessageField<FieldForm::kHash, M, T> hash(std::uint8_t number, std::string_view name, T M::*member) {
    return {number, name, member};
}
template <typename M>
constexpr MessageField<FieldForm::kBlob, M, BlobInfo> blob(std::uint8_t number, std::string_view name,
                                                           BlobInfo M::*member) {
    return {number, name, member};
}
template <typename M>
constexpr MessageField<FieldForm::kBytes, M, ByteSlice> bytes(std::string_view name, ByteSlice M::*member) {
    return {0, name, member};
}
template <typename M, typename Record>
constexpr MessageField<FieldForm::kRecords, M, std::vector<Record>> records(std::string_view name,
                                                                            std::vector<Record> M::*member) {
    return {0, name, member};
}
template <typename M>
constexpr MessageField<FieldForm::kList, M, CommittedListPtr> list(std::uint8_t number, CommittedListPtr M::*member) {
    return {number, "list", member};
}
}  // namespace message::field

template <typename M>
concept Described = requires {
    { M::kInfo } -> std::convertible_to<MessageInfo>;
    M::fields();
};

/// `visit(field)` for each field of M, in their order.
template <Described M, typename Visit>
constexpr void forEachField(Visit&& visit) {
    std::apply([&](const auto&... fields) { (visit(fields), ...); }, M::fields());
}

/// Equal in everything that is sent; lists by what they hold.
template <Described M>
[[nodiscard]] bool sameFields(const M& a, const M& b) {
    const auto same = [&]<FieldForm Form, typename T>(const MessageField<Form, M, T>& f) {
        if constexpr (Form == FieldForm::kList)
            return *(a.*f.member) == *(b.*f.member);
        else
            return a.*f.member == b.*f.member;
    };
    return std::apply([&](const auto&... fields) { return (same(fields) && ...); }, M::fields());
}

}  // namespace tessera
