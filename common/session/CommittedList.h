/// The one envelope in which a list travels, from the commit to whoever applies it.
#pragma once

#include <memory>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/ByteSlice.h"
#include "common/base/HistoryIds.h"

namespace tessera {

struct BlobInfo {
    BlobId id;
    std::uint64_t sizeBytes = 0;
    bool operator==(const BlobInfo&) const = default;
};

/// A list as bytes, and where it leads. Made once, by who commits it or by who receives it, and then only shared:
/// frames, messages, queues and work hold a CommittedListPtr. Whether the list is a change or a whole scene says who
/// hands it on.
struct CommittedList {
    Sequence sequence;            ///< where the scene stands after it
    StateHash stateHash;          ///< of the scene after it
    ByteSlice encoded;            ///< codec ChangeCodec; none: nothing changed, the scene stands there already
    std::vector<BlobInfo> blobs;  ///< that it names and earlier lists did not; to be fetched before it is applied

    [[nodiscard]] bool changed() const { return !encoded.empty(); }
    bool operator==(const CommittedList&) const = default;
};

/// Never null where a message or a frame holds one.
using CommittedListPtr = std::shared_ptr<const CommittedList>;

[[nodiscard]] inline CommittedListPtr share(CommittedList list) {
    return std::make_shared<const CommittedList>(std::move(list));
}
/// Of the empty scene.
[[nodiscard]] inline CommittedListPtr nothingCommitted() {
    static const CommittedListPtr nothing = std::make_shared<const CommittedList>();
    return nothing;
}

}  // namespace tessera
