/// Culling of what is hidden: draws the best occluders into a depth buffer of the tile's own pixels, tests all else.
#pragma once

#include <cstdint>
#include <vector>

#include "client/render/OccluderRasteriser.h"
#include "client/render/OcclusionBuffer.h"
#include "client/render/SceneItems.h"

namespace tessera {

/// What a look for hidden things has cost, and what it saves of drawing: estimates from counts, the same on each run.
struct CullingWork {
    double spentNs = 0, savedNs = 0;
};

/// After Hasselgren et al. 2016 in its idea (depth in software, coarse depth over it), not in its layout.
///
/// All occluders come first, then all tests: so the answer does not depend on an order. Hiding is strict: a hidden
/// occluder is hidden by what stays, so that leaving it away uncovers nothing.
///
/// What was hidden the last time is not tried as an occluder: that is all that is remembered, and it touches speed
/// alone.
class MaskedCuller {
public:
    /// `items`: what passed the frustum test; what is hidden is taken out.
    CullingWork cull(const RenderScene::Impl& scene, const ScreenCamera& camera, const PixelRect& pixels,
                     std::vector<std::uint32_t>& items);
    /// Of an item that `cull` has left: where its clusters' bits begin in `hiddenClusters`, see DrawItem.
    [[nodiscard]] std::uint32_t hiddenFrom(std::uint32_t item) const {
        return item < hiddenFrom_.size() ? hiddenFrom_[item] : DrawItem::kNoneHidden;
    }
    [[nodiscard]] const std::vector<std::uint64_t>& hiddenClusters() const { return hiddenClusters_; }
    /// What was found is not true of another sight.
    void forget() {
        hiddenFrom_.clear();
        hiddenClusters_.clear();
    }

private:
    struct Candidate {
        std::uint32_t item;
        double cost;     ///< estimated, ns
        double benefit;  ///< pixels per ns, times the share of the work that lies beyond
        Footprint footprint;
    };

    void drawOccluders(const RenderScene::Impl& scene, const TileProjection& tile,
                       const std::vector<std::uint32_t>& items);
    void keepVisible(const RenderScene::Impl& scene, const TileProjection& tile, const Frustum& frustum,
                     std::vector<std::uint32_t>& items);

    /// Whether any cluster of a large mesh is left.
    [[nodiscard]] bool keepVisibleClusters(const TileProjection& tile, const SceneItem& item, std::uint32_t index,
                                           const Mat4d& clip_T_item, double noise);

    OcclusionBuffer buffer_;
    OccluderRasteriser rasteriser_;
    std::vector<Candidate> candidates_;
    std::vector<bool> hiddenBefore_;  ///< by item
    std::vector<std::uint32_t> hiddenFrom_;  ///< by item
    std::vector<std::uint64_t> hiddenClusters_;
    CullingWork work_;
    std::uint64_t rebuilds_ = 0;      ///< of the scene that the items were those of
};

}  // namespace tessera
