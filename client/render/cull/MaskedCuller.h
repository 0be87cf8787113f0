/// Culling of what is hidden: draws the best occluders into a depth buffer of the tile's own pixels, tests all else.
#pragma once

#include <cstdint>
#include <vector>

#include "client/render/cull/OccluderChoice.h"
#include "client/render/cull/OccluderRasteriser.h"
#include "client/render/cull/OcclusionBuffer.h"
#include "client/render/scene/SceneItems.h"

namespace tessera {

/// What a look for hidden things has cost, and what it saves of drawing: estimates from counts, the same on each run.
struct CullingWork {
    double spentNs = 0, savedNs = 0;
};

/// After Hasselgren et al. 2016 in its idea (depth in software, coarse depth over it), not in its layout.
///
/// Rounds of occluders first, then tests: so the answer does not depend on an order. Hiding is strict: a hidden
/// occluder is hidden by what stays, so that leaving it away uncovers nothing.
///
/// What was hidden the last time is not tried as an occluder in the first round: that is all that is remembered, and it
/// touches speed alone. After a leap it is the wrong thing to leave out; so what is left then, and is worth it for what
/// else is left, has a second round. Of large meshes those parts are drawn that hide more than they cost.
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
    /// Of one call of `cull`.
    struct Look {
        const RenderScene::Impl& scene;
        const TileProjection& tile;
        double budgetNs = 0, spentNs = 0;  ///< for occluders
        std::uint64_t preparedTriangles = 0;
        bool drawn = false;  ///< any occluder; the buffer is then this look's
    };

    /// The candidates of the choice. False: none was drawn.
    bool drawOccluders(Look& look);
    void drawOccluder(Look& look, const OccluderChoice::Candidate& candidate);
    /// All that is in the frustum and not hidden.
    void keepVisible(const Look& look, const Frustum& frustum, std::vector<std::uint32_t>& items);
    [[nodiscard]] bool hides(const Look& look, std::uint32_t item);
    /// Whether any cluster of a large mesh is left.
    [[nodiscard]] bool keepVisibleClusters(const Look& look, std::uint32_t item);

    OccluderChoice choice_;
    OcclusionBuffer buffer_;
    OccluderRasteriser rasteriser_;
    std::vector<bool> hiddenBefore_;           ///< by item
    std::vector<bool> tried_;                  ///< by item: as an occluder, in this look
    std::vector<std::uint32_t> all_;           ///< items in the frustum
    std::vector<OccluderChoice::Part> parts_;  ///< clusters of a mesh
    std::vector<OccluderMesh::Run> runs_;
    std::vector<std::uint32_t> hiddenFrom_;  ///< by item
    std::vector<std::uint64_t> hiddenClusters_;
    CullingWork work_;
    std::uint64_t rebuilds_ = 0;  ///< of the scene that the items were those of
};

}  // namespace tessera
