/// Described records (common/request/Description.h) as the parts of messages: of fixed size, little-endian, one behind
/// the other, with their texts in a part of their own. Not for other modules.
#pragma once

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/request/Description.h"

namespace tessera {

struct PackedRecords {
    Bytes bytes, texts;
};
/// `count` values of that type, which lie one behind the other.
[[nodiscard]] PackedRecords packRecords(const Description& of, const void* values, std::size_t count);

/// Fills what holds values of that type, a vector or an optional; on failure it is empty. At most `most`, counted
/// before memory is taken (kLimit). kBadInput: a broken record, one that says what cannot be, texts that are not as
/// long as the records say. `findFault` asks for their members' bounds.
[[nodiscard]] Expected<void> unpackRecords(const Description& of, ByteSpan bytes, std::size_t most, ByteSpan texts,
                                           const Holder& holder, void* values);
/// The same of numbers, `bytes` of memory each, as they lie there.
[[nodiscard]] Expected<void> unpackNumbers(std::size_t bytesOfOne, ByteSpan bytes, std::size_t most,
                                           const Holder& holder, void* values);

}  // namespace tessera
