/// The payload of Begin and the statistics of Ready.
#pragma once

#include <string>
#include <vector>

#include "common/codec/ChangeCodec.h"
#include "common/wall/View.h"

namespace tessera {

struct FramePayload {
    View view;
    SharedBytes list;  ///< encoded ChangeList of this frame; null when nothing changed
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
