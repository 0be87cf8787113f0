/// The pixels of one patch: where it lies, where it ends, what it hides there. See OccluderRasteriser.h for why this is
/// safe.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "client/render/TileProjection.h"
#include "client/render/cull/OcclusionBuffer.h"
#include "client/render/cull/RowSpans.h"

namespace tessera {

/// Mark all of a patch's polygons, then unmark along all its borders, then merge. Empty again afterwards.
class PatchMarks {
public:
    /// Greater than what a vertex may be displaced by + half a step of a 1/256 grid + our own rounding of far-away
    /// pixels (1/16).
    static constexpr double kMarkMarginPx = 0.25;
    /// Greater by the same again: a border that might touch a marked square unmarks it.
    static constexpr double kUnmarkMarginPx = 0.45;

    /// For patches of one mesh, with this noise (see TileProjection). False where noise leaves nothing of depth.
    [[nodiscard]] bool begin(const TileProjection& tile, double noise, const OcclusionBuffer& buffer);
    /// The next patch: what rows of blocks it may reach, and its greatest inverse depth. Blocks at either end of a row
    /// where all that it could say is known already are left out.
    void beginPatch(float lowerY, float upperY, float nearest, const OcclusionBuffer& buffer);
    /// Three or four corners in one plane.
    void mark(std::span<const ScreenPoint> corners);
    void unmark(const ScreenPoint& from, const ScreenPoint& to);
    /// Returns the pixels of the blocks that were touched.
    std::uint64_t mergeInto(OcclusionBuffer& buffer);

private:
    struct Touched {
        int from = std::numeric_limits<int>::max();
        int to = -1;
    };

    template <typename F>
    void forEachTouchedRow(F&& f);

    double shrink_ = 1, shift_ = 0;  ///< what noise takes off an inverse depth
    double planeRounding_ = 0;       ///< of an interpolated inverse depth, per unit of slope
    int columns_ = 0, rows_ = 0;
    /// Least inverse depth by pixel of the tile; between patches infinite everywhere.
    std::vector<float> values_;
    std::vector<Touched> touched_;  ///< by row of blocks: where the patch has written
    std::vector<Touched> open_;     ///< by row of blocks: the pixels where it may
    RowSpans spans_;
};

}  // namespace tessera
