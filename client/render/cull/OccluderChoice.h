/// Which items, and which parts of large ones, are worth being drawn as occluders of a tile. Touches speed alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client/render/cull/ClusterGlance.h"
#include "client/render/scene/SceneItems.h"

namespace tessera {

/// What `masked` costs and what drawing costs, in nanoseconds (measured on two cores; COSTS.md says how). Only ratios
/// matter.
struct CullingCosts {
    static constexpr double kTriangle = 60;  ///< of an occluder
    static constexpr double kPixel = 1.2;    ///< of an occluder
    static constexpr double kOccluder = 500;
    static constexpr double kResetPixel = 0.3;
    static constexpr double kTest = 300;
    static constexpr double kGlance = 25;  ///< at a cluster
    static constexpr double kDrawnTriangle = 130;
    static constexpr double kDrawnItem = 2000;
    static constexpr double kDrawnCluster = kDrawnTriangle * MeshCluster::kTriangles;
    static constexpr double kClusterOccluder = kTriangle * MeshCluster::kTriangles;
};

/// Weighs what drawing each item would cost, proposes those that hide most of that for the least, front to back within
/// what a budget has room for. The answers depend on the scene and the sight alone: they are the same on every run.
class OccluderChoice {
public:
    struct Candidate {
        std::uint32_t item;
        bool inParts;    ///< its mesh has clusters
        double cost;     ///< estimated; in parts, as if all that is shown were drawn
        double benefit;  ///< ns of drawing that it may save per ns
        Footprint footprint;
    };

    struct Part {
        std::uint32_t cluster;
        double facing;  ///< see ClusterGlance
    };

    /// A look at a tile begins. All of it must live until the look ends.
    void begin(const RenderScene::Impl& scene, const TileProjection& tile, const Vec3d& eyeWorld);
    /// What drawing these costs, and where that lies in depth. For the first time of a look `anew`.
    void weigh(std::span<const std::uint32_t> items, bool anew);
    [[nodiscard]] double totalNs() const { return depths_.total(); }
    [[nodiscard]] double drawingNs(std::uint32_t item) const { return static_cast<double>(drawingNs_[item]); }
    /// What the weighing took, from counts.
    [[nodiscard]] double spentNs() const { return spentNs_; }

    /// Candidates from now on: those among `items` for which `may` and that can hide things, the best ones first. What
    /// saves less than `ratio` times its cost is left out, but for the best of that, up to `freeNs`. Of large meshes
    /// the parts are asked later. After `weigh`.
    template <typename May>
    void propose(std::span<const std::uint32_t> items, double ratio, double freeNs, May&& may) {
        candidates_.clear();
        for (const std::uint32_t item : items)
            if (may(item)) consider(item, ratio, freeNs);
        rank(ratio, freeNs);
    }
    [[nodiscard]] std::span<const Candidate> candidates() const { return candidates_; }
    /// Of candidates in the order of `propose`, from `begin`: puts as many as cost `budgetNs` together, one at least,
    /// front to back. Returns their end.
    [[nodiscard]] std::size_t nextBatch(std::size_t begin, double budgetNs);

    /// Of a large mesh, ascending: those that are shown; those of them that may save at least `ratio` times what they
    /// cost, and what they cost, in ns.
    void shownParts(std::uint32_t item, std::vector<Part>& parts);
    [[nodiscard]] double worthyParts(std::uint32_t item, double ratio, std::vector<Part>& parts);

private:
    /// How much of what is drawn lies beyond a depth, roughly: by octaves in eighths.
    class DepthHistogram {
    public:
        void clear() {
            weights_.fill(0);
            total_ = 0;
        }
        void add(double depth, double weight) {
            weights_[bin(depth)] += weight;
            total_ += weight;
        }
        /// Call when all is added.
        void accumulate();
        [[nodiscard]] double beyond(double depth) const {
            const std::size_t next = bin(depth) + 1;
            return next < kBins ? weights_[next] : 0;
        }
        [[nodiscard]] double total() const { return total_; }

    private:
        static constexpr std::size_t kBins = 256;
        static std::size_t bin(double depth);
        std::array<double, kBins> weights_{};
        double total_ = 0;
    };

    void consider(std::uint32_t item, double ratio, double freeNs);
    void rank(double ratio, double freeNs);
    [[nodiscard]] double shownNs(const SceneItem& item);
    template <typename F>
    void forEachShown(const SceneItem& item, F&& f);
    /// Before the other, whatever the scene has been through.
    [[nodiscard]] bool tie(const Candidate& a, const Candidate& b) const;
    /// What a pixel may save that is hidden beyond this depth.
    [[nodiscard]] double worthOfPixel(double depth) const;

    const RenderScene::Impl* scene_ = nullptr;
    const TileProjection* tile_ = nullptr;
    Vec3d eyeWorld_ = Vec3d::Zero();
    double tilePx_ = 1, spentNs_ = 0;
    std::vector<float> drawingNs_;  ///< by item; of those weighed in this look
    DepthHistogram depths_;
    std::vector<Candidate> candidates_;
};

[[nodiscard]] inline Mat4d clipFromItem(const TileProjection& tile, const SceneItem& item) {
    return tile.clip_T_world() * item.world_T_item.matrix();
}
/// See TileProjection.
[[nodiscard]] inline double noiseOf(const TileProjection& tile, const SceneItem& item) {
    return tile.noise(item.reach, item.world_T_item.translation());
}

}  // namespace tessera
