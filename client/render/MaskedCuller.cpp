#include "client/render/MaskedCuller.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera {

namespace {

/// What this culler costs, and what drawing costs on two cores (measured; see README.md). Only their ratio matters, and
/// only for speed.
constexpr double kNsPerTriangle = 60;
constexpr double kNsPerPixel = 1.2;
constexpr double kNsPerOccluder = 500;
constexpr double kNsPerResetPixel = 0.3;
constexpr double kNsPerTest = 300;
constexpr double kNsPerDrawnTriangle = 130;
constexpr double kNsPerDrawnItem = 2000;
/// Occluders may cost this share of what drawing everything in the frustum would.
constexpr double kShareOfDrawing = 0.04;
constexpr double kLeastBudgetNs = 200'000;
/// What covers less hides too little.
constexpr double kLeastOccluderPx = 400;
/// What has nothing beyond its far end may yet hide what stands beside it.
constexpr double kLeastWorth = 0.02;
/// Meshes are made ready for hiding at most at this rate, so that a scene that has just been loaded does not make one
/// frame wait for all of them.
constexpr std::uint64_t kPreparedTrianglesPerFrame = 200'000;

/// How much of what is drawn lies beyond a depth, roughly: by octaves in eighths.
class DepthHistogram {
public:
    void add(double depth, double weight) {
        weights_[bin(depth)] += weight;
        total_ += weight;
    }
    /// Call when all is added.
    void accumulate() {
        for (std::size_t i = kBins - 1; i-- > 0;) weights_[i] += weights_[i + 1];
    }
    [[nodiscard]] double shareBeyond(double depth) const {
        const std::size_t next = bin(depth) + 1;
        return next < kBins && total_ > 0 ? weights_[next] / total_ : 0;
    }

private:
    static constexpr std::size_t kBins = 256;
    static std::size_t bin(double depth) {
        return static_cast<std::size_t>(std::clamp(8 * (std::log2(std::max(depth, 1e-9)) + 10), 0.0, kBins - 1.0));
    }
    std::array<double, kBins> weights_{};
    double total_ = 0;
};

double noiseOf(const RenderScene::Impl& scene, const TileProjection& tile, const SceneItem& item) {
    return tile.noise(item.reach, scene.places[item.place].world_T_node.translation());
}

double drawingNs(const SceneItem& item) {
    return kNsPerDrawnItem + kNsPerDrawnTriangle * static_cast<double>(item.mesh->triangles);
}

Mat4d clipFromItem(const RenderScene::Impl& scene, const TileProjection& tile, const SceneItem& item) {
    return tile.clip_T_world() * scene.places[item.place].world_T_node.matrix();
}

}  // namespace

CullingWork MaskedCuller::cull(const RenderScene::Impl& scene, const ScreenCamera& camera, const PixelRect& pixels,
                               std::vector<std::uint32_t>& items) {
    const double reach = scene.widestLineReachPx();
    const TileProjection tile(camera, pixels, reach);
    work_ = {};
    forget();
    if (!tile.usable() || items.empty()) return work_;
    if (rebuilds_ != scene.rebuilds) {
        rebuilds_ = scene.rebuilds;
        hiddenBefore_.clear();
    }
    hiddenBefore_.resize(scene.items.size(), false);
    hiddenFrom_.assign(scene.items.size(), DrawItem::kNoneHidden);
    buffer_.reset(pixels.width, pixels.height);
    work_.spentNs += kNsPerResetPixel * pixels.width * pixels.height;
    drawOccluders(scene, tile, items);
    keepVisible(scene, tile, tileFrustum(camera, pixels, kFrustumMarginPx + reach), items);
    return work_;
}

void MaskedCuller::drawOccluders(const RenderScene::Impl& scene, const TileProjection& tile,
                                 const std::vector<std::uint32_t>& items) {
    candidates_.clear();
    double allNs = 0;
    DepthHistogram depths;
    for (const std::uint32_t i : items) {
        const SceneItem& item = scene.items[i];
        const double w = tile.clip_T_world().row(3).dot(scene.boxes[i].center().homogeneous());
        const double drawn = drawingNs(item);
        allNs += drawn;
        depths.add(w, drawn);
        if (hiddenBefore_[i] || !item.occludes || item.mesh->triangles > OccluderMesh::kMaxTriangles) continue;
        // Cheaper than a footprint, and enough for the many that are small.
        const double reach = scene.boxes[i].size().norm();
        const double reachPx = reach * tile.metresPerUnit() * tile.pixelsPerMetre();
        if (w > reach * tile.metresPerUnit() && reachPx * reachPx < kLeastOccluderPx * w * w) continue;
        const Mat4d clip_T_item = clipFromItem(scene, tile, item);
        const double area = tile.coveredPx(clip_T_item, item.mesh->bounds);
        if (area < kLeastOccluderPx) continue;
        const Footprint footprint = tile.footprint(clip_T_item, item.mesh->bounds, noiseOf(scene, tile, item));
        const double cost =
            kNsPerOccluder + kNsPerTriangle * static_cast<double>(item.mesh->triangles) + kNsPerPixel * area;
        candidates_.push_back({i, cost, area / cost, footprint});
    }
    depths.accumulate();
    for (Candidate& candidate : candidates_)
        candidate.benefit *= kLeastWorth + depths.shareBeyond(candidate.footprint.farthest);
    // Ties by node, so that the choice is the same on every run, whatever the scene has been through.
    const auto tie = [&scene](const Candidate& a, const Candidate& b) {
        return scene.items[a.item].node < scene.items[b.item].node;
    };
    std::sort(candidates_.begin(), candidates_.end(), [&](const Candidate& a, const Candidate& b) {
        return a.benefit != b.benefit ? a.benefit > b.benefit : tie(a, b);
    });

    double budget = std::max(kLeastBudgetNs, kShareOfDrawing * allNs);
    std::uint64_t prepared = 0;
    for (std::size_t begin = 0; begin < candidates_.size() && budget > 0;) {
        // As many as the budget has room for, front to back: what is hidden by then costs nothing and leaves room for
        // more.
        std::size_t end = begin;
        for (double sum = 0; end < candidates_.size() && (end == begin || sum + candidates_[end].cost <= budget); ++end)
            sum += candidates_[end].cost;
        const auto batch = candidates_.begin();
        std::sort(batch + static_cast<std::ptrdiff_t>(begin), batch + static_cast<std::ptrdiff_t>(end),
                  [&](const Candidate& a, const Candidate& b) {
                      if (a.footprint.nearPlane != b.footprint.nearPlane) return a.footprint.nearPlane;
                      return a.footprint.nearest != b.footprint.nearest ? a.footprint.nearest > b.footprint.nearest
                                                                        : tie(a, b);
                  });
        for (; begin < end; ++begin) {
            const Candidate& candidate = candidates_[begin];
            if (buffer_.hides(candidate.footprint)) continue;
            const SceneItem& item = scene.items[candidate.item];
            if (!item.mesh->occluderReady()) {
                if (prepared > 0 && prepared + item.mesh->triangles > kPreparedTrianglesPerFrame) continue;
                prepared += item.mesh->triangles;
            }
            const OccluderMesh* mesh = item.mesh->occluder();
            if (!mesh) continue;
            budget -= candidate.cost;
            work_.spentNs += candidate.cost;
            rasteriser_.add(*mesh,
                            {.clip_T_mesh = clipFromItem(scene, tile, item),
                             .mirrored = item.mirrored,
                             .noise = noiseOf(scene, tile, item)},
                            tile, buffer_);
        }
    }
}

void MaskedCuller::keepVisible(const RenderScene::Impl& scene, const TileProjection& tile, const Frustum& frustum,
                               std::vector<std::uint32_t>& items) {
    for (const std::uint32_t i : items) {
        hiddenBefore_[i] = true;
        work_.savedNs += drawingNs(scene.items[i]);
    }
    items.clear();
    const double reach = scene.reaches.bound();
    struct Open {
        std::uint32_t node;
        Frustum::Mask mask;
    };
    std::vector<Open> open{{BoxTree::kRoot, Frustum::kAllPlanes}};
    while (!open.empty()) {
        const auto [index, mask] = open.back();
        open.pop_back();
        const BoxTree::Node& node = scene.tree.node(index);
        const Frustum::Result result = frustum.classify(node.box, mask);
        if (result.outside) continue;
        work_.spentNs += kNsPerTest;
        const double noise = tile.noise(reach, node.box);
        if (buffer_.hides(tile.footprint(tile.clip_T_world(), node.box, noise))) continue;
        if (!node.leaf) {
            open.push_back({node.below[1], result.undecided});
            open.push_back({node.below[0], result.undecided});
            continue;
        }
        for (const std::uint32_t i : node.items()) {
            if (frustum.classify(scene.boxes[i], result.undecided).outside) continue;
            const SceneItem& item = scene.items[i];
            work_.spentNs += kNsPerTest;
            const Mat4d clip_T_item = clipFromItem(scene, tile, item);
            const double itemNoise = noiseOf(scene, tile, item);
            if (buffer_.hides(tile.footprint(clip_T_item, item.mesh->bounds, itemNoise))) continue;
            if (!keepVisibleClusters(tile, item, i, clip_T_item, itemNoise)) continue;
            hiddenBefore_[i] = false;
            work_.savedNs -= drawingNs(item);
            items.push_back(i);
        }
    }
}

bool MaskedCuller::keepVisibleClusters(const TileProjection& tile, const SceneItem& item, std::uint32_t index,
                                       const Mat4d& clip_T_item, double noise) {
    const std::vector<MeshCluster>& clusters = item.mesh->clusters;
    if (clusters.empty()) return true;
    const std::size_t first = hiddenClusters_.size();
    hiddenClusters_.resize(first + wordsFor(clusters.size()));
    std::size_t hidden = 0;
    for (std::size_t k = 0; k < clusters.size(); ++k) {
        work_.spentNs += kNsPerTest;
        if (!buffer_.hides(tile.footprint(clip_T_item, clusters[k].box(), noise))) continue;
        hiddenClusters_[first + k / 64] |= std::uint64_t{1} << k % 64;
        ++hidden;
    }
    if (hidden == 0) {
        hiddenClusters_.resize(first);
        return true;
    }
    work_.savedNs += kNsPerDrawnTriangle * static_cast<double>(hidden * MeshCluster::kTriangles);
    hiddenFrom_[index] = static_cast<std::uint32_t>(first);
    return hidden < clusters.size();
}

}  // namespace tessera
