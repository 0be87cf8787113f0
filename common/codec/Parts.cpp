#include "common/codec/Parts.h"

namespace tessera {

namespace {
template <typename T>
T take(ByteSpan& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes = bytes.subspan(sizeof value);
    return value;
}

std::size_t sizeOf(const google::protobuf::MessageLite& head) {
    return head.ByteSizeLong();
}
std::size_t sizeOf(ByteSpan head) {
    return head.size();
}
void write(const google::protobuf::MessageLite& head, std::byte* at) {
    head.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(at));
}
void write(ByteSpan head, std::byte* at) {
    std::copy(head.begin(), head.end(), at);
}

/// Everything before the parts, with room behind it for `roomBehind` bytes more.
template <typename Head, typename Part>
Bytes headOf(const Head& head, std::span<const Part> parts, std::size_t roomBehind) {
    const std::size_t headBytes = sizeOf(head);
    const std::size_t total = 8 + 8 * parts.size() + headBytes;
    Bytes bytes;
    bytes.reserve(total + roomBehind);
    bytes.resize(total);
    std::byte* at = bytes.data();
    const auto put = [&at](const auto& value) {
        std::memcpy(at, &value, sizeof value);
        at += sizeof value;
    };
    put(static_cast<std::uint32_t>(headBytes));
    put(static_cast<std::uint32_t>(parts.size()));
    for (const Part& part : parts) put(static_cast<std::uint64_t>(part.size()));
    write(head, at);
    return bytes;
}

template <typename Head>
Bytes joined(const Head& head, std::span<const ByteSpan> parts) {
    std::size_t behind = 0;
    for (const ByteSpan part : parts) behind += part.size();
    Bytes bytes = headOf(head, parts, behind);
    for (const ByteSpan part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
    return bytes;
}

template <typename Head>
ByteChain chainOf(const Head& head, std::span<const ByteSlice> parts) {
    ByteChain chain;
    chain.append(headOf(head, parts, 0));
    for (const ByteSlice& part : parts) chain.append(part);
    return chain;
}
}  // namespace

Bytes joinParts(const google::protobuf::MessageLite& head, std::span<const ByteSpan> parts) {
    return joined(head, parts);
}

Bytes joinParts(ByteSpan head, std::span<const ByteSpan> parts) {
    return joined(head, parts);
}

ByteChain chainParts(const google::protobuf::MessageLite& head, std::span<const ByteSlice> parts) {
    return chainOf(head, parts);
}

ByteChain chainParts(ByteSpan head, std::span<const ByteSlice> parts) {
    return chainOf(head, parts);
}

Expected<SplitParts> splitParts(ByteSpan bytes, std::size_t maxHeadBytes, std::size_t maxParts) {
    if (bytes.size() < 8) return fail(ErrorCode::kBadInput, "it is too short");
    const auto headBytes = take<std::uint32_t>(bytes);
    const auto count = take<std::uint32_t>(bytes);
    if (headBytes > maxHeadBytes)
        return fail(ErrorCode::kLimit, "its head claims " + std::to_string(headBytes) + " bytes; at most " +
                                           std::to_string(maxHeadBytes) + " are allowed");
    if (count > maxParts)
        return fail(ErrorCode::kLimit, "it claims " + std::to_string(count) + " parts; at most " +
                                           std::to_string(maxParts) + " are allowed");
    if (bytes.size() / 8 < count) return fail(ErrorCode::kBadInput, "it is cut off");
    ByteSpan sizes = bytes.first(8 * std::size_t{count});
    bytes = bytes.subspan(sizes.size());
    if (bytes.size() < headBytes) return fail(ErrorCode::kBadInput, "it is cut off");

    SplitParts split;
    split.head = bytes.first(headBytes);
    bytes = bytes.subspan(headBytes);
    split.parts.reserve(count);
    while (!sizes.empty()) {
        const auto size = take<std::uint64_t>(sizes);
        if (size > bytes.size()) return fail(ErrorCode::kBadInput, "it is cut off");
        split.parts.push_back(bytes.first(size));
        bytes = bytes.subspan(size);
    }
    if (!bytes.empty()) return fail(ErrorCode::kBadInput, std::to_string(bytes.size()) + " bytes follow its end");
    return split;
}

}  // namespace tessera
