/// Values of ApplicationScene.h as arrays of records of fixed size, little-endian, with their texts in one piece.
#pragma once

#include <span>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/codec/ApplicationScene.h"

namespace tessera {

struct PackedObjects {
    Bytes records, texts;
};
[[nodiscard]] PackedObjects packObjects(std::span<const ObjectInfo> objects);
[[nodiscard]] Bytes packTree(std::span<const TreeNode> nodes);

/// At most `most` entries, counted before memory is taken (kLimit). kBadInput: a broken entry, texts that are not as long
/// as the entries say.
[[nodiscard]] Expected<std::vector<ObjectInfo>> unpackObjects(ByteSpan records, ByteSpan texts, std::size_t most);
[[nodiscard]] Expected<std::vector<TreeNode>> unpackTree(ByteSpan records, std::size_t most);

}  // namespace tessera
