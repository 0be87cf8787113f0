/// What a Begin says beside its list, and the statistics of Ready.
#pragma once

#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/wall/View.h"

namespace tessera {

/// What a frame's collision detection found, in numbers. A render host draws contacts as what they are in the scene;
/// lists of them go to applications, which ask for them (ApplicationCodec.h).
struct FrameCollision {
    std::uint64_t contacts = 0;  ///< pairs of faces
    std::uint64_t begun = 0;     ///< pairs of objects that touch now and did not before
    std::uint64_t ended = 0;
    std::uint64_t near = 0;  ///< pairs of objects nearer than the threshold of their interest
    double nearest = 0;      ///< the least of their distances; world units. Only with `near` above 0
    bool operator==(const FrameCollision&) const = default;
};

struct FramePayload {
    View view;
    FrameCollision collision = {};
};
[[nodiscard]] Bytes encodeFrame(const FramePayload& payload);
[[nodiscard]] Expected<FramePayload> decodeFrame(ByteSpan bytes);

/// One tile's work on one frame.
struct TileStats {
    std::string tile;
    double cullMs = 0, drawMs = 0;
    std::uint64_t inFrustum = 0;  ///< draw items in the tile's frustum
    std::uint64_t drawn = 0;      ///< of those, not found hidden
    std::uint64_t trianglesDrawn = 0;
    bool operator==(const TileStats&) const = default;
};
[[nodiscard]] Bytes encodeStats(const std::vector<TileStats>& stats);
[[nodiscard]] Expected<std::vector<TileStats>> decodeStats(ByteSpan bytes);

}  // namespace tessera
