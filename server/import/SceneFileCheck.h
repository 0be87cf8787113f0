/// Opening a SceneFile that a stranger wrote, without letting it take memory first.
#pragma once

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "proto/scene.pb.h"

namespace tessera {

struct SceneFileLimits {
    /// Fields present, at all depths. A few bytes of empty sub-messages become hundreds of bytes of objects, so
    /// counting the bytes is not enough.
    std::size_t maxElements = 8'000'000;
    int maxDepth = 256 + 8;  ///< messages in messages: nodes, and what the innermost holds
};

/// Counts before it parses. Never fails otherwise than with an error, whatever the bytes are.
[[nodiscard]] Expected<proto::scene::SceneFile> parseSceneFile(ByteSpan bytes, const SceneFileLimits& limits = {});

}  // namespace tessera
