/// Opening a SceneFile that a stranger wrote, without letting it take memory first.
#pragma once

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/base/Limits.h"
#include "proto/scene.pb.h"

namespace tessera {

struct SceneFileLimits {
    /// Fields present, at all depths. A few bytes of empty sub-messages become hundreds of bytes of objects, so
    /// counting the bytes is not enough: beyond `freeElements` there are at most one for each `bytesPerElement`.
    std::size_t maxElements = limits::kMaxFileElements;
    std::size_t freeElements = limits::kFreeFileElements;
    std::size_t bytesPerElement = limits::kBytesPerFileElement;
    int maxDepth = 256 + 8;  ///< messages in messages: nodes, and what the innermost holds
};

/// Counts before it parses. Never fails otherwise than with an error, whatever the bytes are.
[[nodiscard]] Expected<proto::scene::SceneFile> parseSceneFile(ByteSpan bytes, const SceneFileLimits& limits = {});

}  // namespace tessera
