/// What a Begin says beside its list, and the statistics of Ready.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/change/Value.h"
#include "common/wall/LightHistogram.h"
#include "common/wall/Showing.h"
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
    Showing showing = Showing::kScene;
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
    // Of cullers that ask the renderer: questions, times that one waited for an answer, triangles drawn for depth
    // alone.
    std::uint64_t queries = 0, waits = 0, depthTriangles = 0;
    double handOverMs = 0;                      ///< the picture laid where it is shown from
    double cullQueuedMs = 0, drawQueuedMs = 0;  ///< of the times above: ready to run, and no processor was free
    // That the picture was divided into (0: it was not), of them neighbours drew, and were drawn here and there.
    std::uint64_t parts = 0, partsHelped = 0, partsTwice = 0;
    bool operator==(const TileStats&) const = default;
};
/// A program of a material that a host draws without, as it took too long; said with each frame until the server has
/// made it heavy.
struct HeldUp {
    ObjectId program;
    double ms = 0;  ///< of a picture, when it was ended
    bool operator==(const HeldUp&) const = default;
};
/// One host's work on one frame, all on its draw thread. Durations by its own clock: hosts' clocks differ.
struct HostStats {
    std::vector<TileStats> tiles;
    double workMs = 0;                      ///< from taking the frame in hand to the last picture
    double applyMs = 0, applyQueuedMs = 0;  ///< the list applied to the replica; of that, as above
    std::uint64_t helpedParts = 0;          ///< of neighbours' pictures, drawn here after the frame before
    double helpMs = 0;                      ///< that took; no part of `workMs`
    std::vector<HeldUp> heldUp = {};
    /// Of all its tiles that show the scene; none: no exposure is metered there.
    std::optional<LightHistogram> light = {};
    bool operator==(const HostStats&) const = default;
};
[[nodiscard]] Bytes encodeStats(const HostStats& stats);
[[nodiscard]] Expected<HostStats> decodeStats(ByteSpan bytes);

}  // namespace tessera
