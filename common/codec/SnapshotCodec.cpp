#include "common/codec/SnapshotCodec.h"

#include <array>
#include <limits>

#include "common/codec/Parts.h"
#include "proto/session.pb.h"

namespace tessera {

namespace {
constexpr std::size_t kMaxHeadBytes = 256;
constexpr std::size_t kParts = 2;  ///< the list, the blobs that it names
}  // namespace

Blob encodeSnapshot(const CommittedList& whole) {
    proto::session::Snapshot head;
    head.set_sequence(whole.sequence.value);
    head.set_state_hash(whole.stateHash.value);
    const std::array<ByteSpan, kParts> parts = {whole.encoded, recordBytes(whole.blobs)};
    return Blob(joinParts(head, parts));
}

Expected<CommittedListPtr> decodeSnapshot(const Blob& content) {
    const Expected<SplitParts> split = splitParts(content.bytes(), kMaxHeadBytes, kParts);
    if (!split) return tl::unexpected(split.error());
    proto::session::Snapshot head;
    if (!head.ParseFromArray(split->head.data(), static_cast<int>(split->head.size())) || split->parts.size() != kParts)
        return fail(ErrorCode::kBadInput, "its head makes no sense");
    // As large as the blob, which has been fetched already: there is nothing left to bound.
    Expected<std::vector<BlobInfo>> blobs = recordsFrom<BlobInfo>(split->parts[1], std::numeric_limits<std::size_t>::max());
    if (!blobs) return tl::unexpected(blobs.error());
    return share(CommittedList{.sequence = Sequence(head.sequence()),
                               .stateHash = StateHash(head.state_hash()),
                               .encoded = ByteSlice(content.shared(), split->parts[0]),
                               .blobs = std::move(*blobs)});
}

}  // namespace tessera
