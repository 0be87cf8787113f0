/// Change lists as bytes: a small protobuf head with the columns raw behind it (proto/change.proto).
#pragma once

#include "common/base/Blob.h"
#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/base/Limits.h"
#include "common/change/ChangeList.h"

namespace tessera {

struct ChangeLimits {
    std::size_t maxBytes = limits::kMaxListBytes;
    std::size_t maxChanges = limits::kMaxListChanges;  ///< creations, placements, rows and destructions together
    std::size_t maxColumns = 4096;
    std::size_t maxTextBytes = limits::kMaxTextBytes;
};

[[nodiscard]] Bytes encodeChangeList(const ChangeList& list);

/// The bytes of its ranges, one behind the other, where they lie in a list that decodeChangeList has taken.
[[nodiscard]] ByteSpan rangeBytesIn(ByteSpan encodedList);

/// What to do with a blob that the store does not have: kRefuse is kNotFound.
enum class AbsentBlobs { kRefuse, kKeepAbsent };

/// Never crashes whatever the bytes are; takes no memory out of proportion to them. Blob columns are resolved in
/// `store`.
[[nodiscard]] Expected<ChangeList> decodeChangeList(ByteSpan bytes, const BlobStore& store,
                                                    AbsentBlobs absent = AbsentBlobs::kRefuse,
                                                    const ChangeLimits& limits = {});

}  // namespace tessera
