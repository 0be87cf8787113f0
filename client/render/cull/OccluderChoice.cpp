#include "client/render/cull/OccluderChoice.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// What covers less hides too little.
constexpr double kLeastOccluderPx = 400;
/// What has nothing beyond its far end may yet hide what stands beside it.
constexpr double kLeastWorth = 0.02;

}  // namespace

std::size_t OccluderChoice::DepthHistogram::bin(double depth) {
    return static_cast<std::size_t>(std::clamp(8 * (std::log2(std::max(depth, 1e-9)) + 10), 0.0, kBins - 1.0));
}

void OccluderChoice::DepthHistogram::accumulate() {
    for (std::size_t i = kBins - 1; i-- > 0;) weights_[i] += weights_[i + 1];
}

void OccluderChoice::begin(const RenderScene::Impl& scene, const TileProjection& tile, const Vec3d& eyeWorld) {
    scene_ = &scene;
    tile_ = &tile;
    eyeWorld_ = eyeWorld;
    tilePx_ = static_cast<double>(tile.widthPx()) * tile.heightPx();
    spentNs_ = 0;
    drawingNs_.resize(scene.items.size());
}

void OccluderChoice::weigh(std::span<const std::uint32_t> items, bool anew) {
    depths_.clear();
    for (const std::uint32_t i : items) {
        if (anew) drawingNs_[i] = static_cast<float>(shownNs(scene_->items[i]));
        depths_.add(tile_->clip_T_world().row(3).dot(scene_->boxes[i].center().homogeneous()), drawingNs(i));
    }
    depths_.accumulate();
}

/// f(cluster, place), ascending.
template <typename F>
void OccluderChoice::forEachShown(const SceneItem& item, F&& f) {
    const std::vector<MeshCluster>& clusters = item.mesh->clusters();
    const ClusterGlance glance(*tile_, item.world_T_item, clipFromItem(*tile_, item), eyeWorld_);
    spentNs_ += CullingCosts::kGlance * static_cast<double>(clusters.size());
    for (std::uint32_t k = 0; k < clusters.size(); ++k)
        if (const ClusterGlance::Place place = glance.at(clusters[k]); place.shown) f(k, place);
}

// What drawing leaves away by itself, beside the tile and turned away, is not saved by hiding it.
double OccluderChoice::shownNs(const SceneItem& item) {
    const std::vector<MeshCluster>& clusters = item.mesh->clusters();
    if (clusters.empty())
        return CullingCosts::kDrawnItem + CullingCosts::kDrawnTriangle * static_cast<double>(item.mesh->triangles);
    double ns = CullingCosts::kDrawnItem;
    forEachShown(item, [&](std::uint32_t, const ClusterGlance::Place& place) {
        ns += place.facing * CullingCosts::kDrawnCluster;
    });
    return ns;
}

void OccluderChoice::consider(std::uint32_t index, double ratio, double freeNs) {
    const SceneItem& item = scene_->items[index];
    const bool inParts = !item.mesh->clusters().empty();
    if (!item.occludes || item.mesh->triangles > OccluderMesh::mostTriangles(inParts)) return;
    // Cheaper than a footprint, and enough for the many that are small or of too many triangles for what they cover.
    const double w = tile_->clip_T_world().row(3).dot(scene_->boxes[index].center().homogeneous());
    const double reach = scene_->boxes[index].size().norm() * tile_->metresPerUnit();
    const double reachPx = reach * tile_->pixelsPerMetre();
    const double triangles = inParts ? (drawingNs(index) - CullingCosts::kDrawnItem) / CullingCosts::kDrawnTriangle
                                     : static_cast<double>(item.mesh->triangles);
    const double leastCost = CullingCosts::kOccluder + CullingCosts::kTriangle * triangles;
    if (w > reach) {
        const double atMost = reachPx * reachPx / ((w - reach / 2) * (w - reach / 2));
        if (atMost < kLeastOccluderPx) return;
        if (!inParts && leastCost > freeNs && atMost * worthOfPixel(0) < ratio * leastCost) return;
    }
    const Mat4d clip_T_item = clipFromItem(*tile_, item);
    const double area = tile_->coveredPx(clip_T_item, item.mesh->bounds);
    if (area < kLeastOccluderPx) return;
    const double cost = leastCost + CullingCosts::kPixel * area;
    const Footprint footprint = tile_->footprint(clip_T_item, item.mesh->bounds, noiseOf(*tile_, item));
    candidates_.push_back({index, inParts, cost, area * worthOfPixel(footprint.farthest) / cost, footprint});
}

double OccluderChoice::worthOfPixel(double depth) const {
    return (kLeastWorth * depths_.total() + depths_.beyond(depth)) / tilePx_;
}

bool OccluderChoice::tie(const Candidate& a, const Candidate& b) const {
    return scene_->items[a.item].node < scene_->items[b.item].node;
}

void OccluderChoice::rank(double ratio, double freeNs) {
    std::sort(candidates_.begin(), candidates_.end(), [this](const Candidate& a, const Candidate& b) {
        return a.benefit != b.benefit ? a.benefit > b.benefit : tie(a, b);
    });
    std::size_t kept = 0;
    double spent = 0;
    for (const Candidate& candidate : candidates_) {
        if (!candidate.inParts) {
            spent += candidate.cost;
            if (candidate.benefit < ratio && spent > freeNs) continue;
        }
        candidates_[kept++] = candidate;
    }
    candidates_.resize(kept);
}

std::size_t OccluderChoice::nextBatch(std::size_t begin, double budgetNs) {
    std::size_t end = begin;
    for (double sum = 0; end < candidates_.size() && (end == begin || sum + candidates_[end].cost <= budgetNs); ++end)
        sum += candidates_[end].cost;
    const auto first = candidates_.begin();
    std::sort(first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(end),
              [this](const Candidate& a, const Candidate& b) {
                  if (a.footprint.nearPlane != b.footprint.nearPlane) return a.footprint.nearPlane;
                  return a.footprint.nearest != b.footprint.nearest ? a.footprint.nearest > b.footprint.nearest
                                                                    : tie(a, b);
              });
    return end;
}

void OccluderChoice::shownParts(std::uint32_t item, std::vector<Part>& parts) {
    parts.clear();
    forEachShown(scene_->items[item], [&](std::uint32_t k, const ClusterGlance::Place& place) {
        parts.push_back({k, place.facing});
    });
}

double OccluderChoice::worthyParts(std::uint32_t item, double ratio, std::vector<Part>& parts) {
    parts.clear();
    double ns = CullingCosts::kOccluder;
    forEachShown(scene_->items[item], [&](std::uint32_t k, const ClusterGlance::Place& place) {
        const double cost = CullingCosts::kClusterOccluder + CullingCosts::kPixel * place.areaPx;
        if (place.areaPx * worthOfPixel(place.farthest) < ratio * cost) return;
        parts.push_back({k, place.facing});
        ns += cost;
    });
    return ns;
}

}  // namespace tessera
