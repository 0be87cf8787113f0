#include "common/codec/SnapshotCodec.h"

#include <array>
#include <limits>

#include "common/codec/MessageHead.h"
#include "common/codec/Parts.h"

namespace tessera {

namespace {
constexpr std::size_t kMaxSnapshotHeadBytes = 256;
constexpr std::size_t kParts = 2;  ///< the list, the blobs that it names
/// Fields of the head, as in a Snapshot that is sent as it is.
constexpr int kSequence = 1, kStateHash = 2;
}  // namespace

Blob encodeSnapshot(const CommittedList& whole) {
    HeadWriter head;
    head.varint(kSequence, whole.sequence.value);
    head.fixed(kStateHash, whole.stateHash.value);
    const std::array<ByteSpan, kParts> parts = {whole.encoded, recordBytes(whole.blobs)};
    return Blob(joinParts(head.bytes(), parts));
}

Expected<CommittedListPtr> decodeSnapshot(const Blob& content) {
    const Expected<SplitParts> split = splitParts(content.bytes(), kMaxSnapshotHeadBytes, kParts);
    if (!split) return tl::unexpected(split.error());
    const Expected<HeadReader> head = HeadReader::read(split->head);
    if (!head || split->parts.size() != kParts) return fail(ErrorCode::kBadInput, "its head makes no sense");
    // As large as the blob, which has been fetched already: there is nothing left to bound.
    Expected<std::vector<BlobInfo>> blobs =
        recordsFrom<BlobInfo>(split->parts[1], std::numeric_limits<std::size_t>::max());
    if (!blobs) return tl::unexpected(blobs.error());
    return share(CommittedList{.sequence = Sequence(head->varint(kSequence)),
                               .stateHash = StateHash(head->fixed(kStateHash)),
                               .encoded = content.slice().slice(split->parts[0]),
                               .blobs = std::move(*blobs)});
}

}  // namespace tessera
