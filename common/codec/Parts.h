/// A small protobuf head with large byte fields raw behind it, so that bulk bytes are never parsed, and need not be
/// copied.
///
/// u32 head bytes | u32 number of parts | u64 bytes of each part | head | parts; little-endian.
#pragma once

#include <google/protobuf/message_lite.h>

#include <bit>
#include <cstring>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"

namespace tessera {

static_assert(std::endian::native == std::endian::little, "the wire is little-endian and written by memcpy");

/// In one piece, which copies the parts.
[[nodiscard]] Bytes joinParts(const google::protobuf::MessageLite& head, std::span<const ByteSpan> parts);
/// The same bytes with the parts where they lie: what is made is the head.
[[nodiscard]] ByteChain chainParts(const google::protobuf::MessageLite& head, std::span<const ByteSlice> parts);
/// With a head that is written already.
[[nodiscard]] Bytes joinParts(ByteSpan head, std::span<const ByteSpan> parts);
[[nodiscard]] ByteChain chainParts(ByteSpan head, std::span<const ByteSlice> parts);

struct SplitParts {
    ByteSpan head;
    std::vector<ByteSpan> parts;  ///< into the bytes that were split
};
/// Everything is checked before memory is taken; nothing may be left over.
[[nodiscard]] Expected<SplitParts> splitParts(ByteSpan bytes, std::size_t maxHeadBytes, std::size_t maxParts);

/// An array of plain records as a part.
template <typename Record>
[[nodiscard]] ByteSpan recordBytes(const std::vector<Record>& records) {
    static_assert(std::is_trivially_copyable_v<Record> && std::has_unique_object_representations_v<Record>);
    return std::as_bytes(std::span(records));
}
template <typename Record>
[[nodiscard]] Expected<std::vector<Record>> recordsFrom(ByteSpan bytes, std::size_t maxRecords) {
    static_assert(std::is_trivially_copyable_v<Record> && std::has_unique_object_representations_v<Record>);
    if (bytes.size() % sizeof(Record) != 0)
        return fail(ErrorCode::kBadInput, "an array ends in the middle of an entry");
    const std::size_t count = bytes.size() / sizeof(Record);
    if (count > maxRecords)
        return fail(ErrorCode::kLimit, "an array of " + std::to_string(count) + " entries; at most " +
                                           std::to_string(maxRecords) + " are allowed");
    std::vector<Record> records(count);
    if (count > 0) std::memcpy(records.data(), bytes.data(), bytes.size());
    return records;
}

}  // namespace tessera
