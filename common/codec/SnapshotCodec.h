/// A whole scene as a blob, for those who join: the list that makes it, where it leads, and the blobs that it names.
#pragma once

#include "common/base/Blob.h"
#include "common/base/Error.h"
#include "common/session/CommittedList.h"

namespace tessera {

[[nodiscard]] Blob encodeSnapshot(const CommittedList& whole);
/// Never crashes whatever the bytes are, and takes memory in proportion to them. The list's bytes stay where they lie
/// in the blob. kBadInput.
[[nodiscard]] Expected<CommittedListPtr> decodeSnapshot(const Blob& content);

}  // namespace tessera
