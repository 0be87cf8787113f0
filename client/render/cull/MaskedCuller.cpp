#include "client/render/cull/MaskedCuller.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// Occluders may cost this share of what drawing everything in the frustum would.
constexpr double kShareOfDrawing = 0.04;
/// Up to here small occluders are drawn without asking what they may save.
constexpr double kLeastBudgetNs = 200'000;
/// How many times its cost an occluder is to be expected to save: some of what lies beyond is seen beside it, or hidden
/// by others as well. 4 to 8 cost the same in the hall and in the city; less hides little more.
constexpr double kRatio = 6;
/// Meshes are made ready for hiding at most at this rate, so that a scene that has just been loaded does not make one
/// frame wait for all of them.
constexpr std::uint64_t kPreparedTrianglesPerFrame = 200'000;

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
    tried_.assign(scene.items.size(), false);
    hiddenFrom_.assign(scene.items.size(), DrawItem::kNoneHidden);

    Look look{.scene = scene, .tile = tile};
    choice_.begin(scene, tile, camera.eyeWorld);
    choice_.weigh(items, true);
    look.budgetNs = std::max(kLeastBudgetNs, kShareOfDrawing * choice_.totalNs());
    all_ = items;
    choice_.propose(items, kRatio, kLeastBudgetNs, [this](std::uint32_t i) { return !hiddenBefore_[i]; });
    if (drawOccluders(look)) keepVisible(look, tileFrustum(camera, pixels, kFrustumMarginPx + reach), items);
    choice_.weigh(items, false);
    choice_.propose(items, kRatio, kLeastBudgetNs - look.spentNs, [this](std::uint32_t i) { return !tried_[i]; });
    if (drawOccluders(look)) std::erase_if(items, [&](std::uint32_t i) { return hides(look, i); });
    if (look.drawn) std::erase_if(items, [&](std::uint32_t i) { return !keepVisibleClusters(look, i); });

    for (const std::uint32_t i : all_) {
        hiddenBefore_[i] = true;
        work_.savedNs += choice_.drawingNs(i);
    }
    for (const std::uint32_t i : items) {
        hiddenBefore_[i] = false;
        work_.savedNs -= choice_.drawingNs(i);
    }
    work_.spentNs += choice_.spentNs();
    return work_;
}

bool MaskedCuller::drawOccluders(Look& look) {
    const double before = look.budgetNs;
    const std::span<const OccluderChoice::Candidate> candidates = choice_.candidates();
    for (std::size_t begin = 0; begin < candidates.size() && look.budgetNs > 0;) {
        // What is hidden by the time that its turn comes costs nothing and leaves room for more.
        for (const std::size_t end = choice_.nextBatch(begin, look.budgetNs); begin < end; ++begin)
            drawOccluder(look, candidates[begin]);
    }
    return look.budgetNs < before;
}

void MaskedCuller::drawOccluder(Look& look, const OccluderChoice::Candidate& candidate) {
    const SceneItem& item = look.scene.items[candidate.item];
    if (look.drawn && buffer_.hides(candidate.footprint)) return;
    double cost = candidate.cost;
    if (candidate.inParts) {
        cost = choice_.worthyParts(candidate.item, kRatio, parts_);
        if (parts_.empty()) return;
    }
    if (!item.mesh->occluderReady()) {
        if (look.preparedTriangles > 0 && look.preparedTriangles + item.mesh->triangles > kPreparedTrianglesPerFrame)
            return;
        look.preparedTriangles += item.mesh->triangles;
    }
    const OccluderMesh* mesh = item.mesh->occluder();
    if (!mesh) return;
    if (!look.drawn) {
        buffer_.reset(look.tile.widthPx(), look.tile.heightPx());
        work_.spentNs += CullingCosts::kResetPixel * look.tile.widthPx() * look.tile.heightPx();
        look.drawn = true;
    }
    const OccluderRasteriser::Placed placed{
        .clip_T_mesh = clipFromItem(look.tile, item), .mirrored = item.mirrored, .noise = noiseOf(look.tile, item)};
    runs_.clear();
    if (candidate.inParts) {
        for (const OccluderChoice::Part& part : parts_) runs_.push_back(mesh->cluster(part.cluster));
    } else {
        runs_.push_back(mesh->all());
    }
    rasteriser_.add(*mesh, runs_, placed, look.tile, buffer_);
    tried_[candidate.item] = true;
    look.budgetNs -= cost;
    look.spentNs += cost;
    work_.spentNs += cost;
}

void MaskedCuller::keepVisible(const Look& look, const Frustum& frustum, std::vector<std::uint32_t>& items) {
    items.clear();
    const double reach = look.scene.reaches.bound();
    struct Open {
        std::uint32_t node;
        Frustum::Mask mask;
    };
    std::vector<Open> open{{BoxTree::kRoot, Frustum::kAllPlanes}};
    while (!open.empty()) {
        const auto [index, mask] = open.back();
        open.pop_back();
        const BoxTree::Node& node = look.scene.tree.node(index);
        const Frustum::Result result = frustum.classify(node.box, mask);
        if (result.outside) continue;
        work_.spentNs += CullingCosts::kTest;
        const double noise = look.tile.noise(reach, node.box);
        if (buffer_.hides(look.tile.footprint(look.tile.clip_T_world(), node.box, noise))) continue;
        if (!node.leaf) {
            open.push_back({node.below[1], result.undecided});
            open.push_back({node.below[0], result.undecided});
            continue;
        }
        for (const std::uint32_t i : node.items())
            if (!frustum.classify(look.scene.boxes[i], result.undecided).outside && !hides(look, i)) items.push_back(i);
    }
}

bool MaskedCuller::hides(const Look& look, std::uint32_t index) {
    const SceneItem& item = look.scene.items[index];
    work_.spentNs += CullingCosts::kTest;
    return buffer_.hides(look.tile.footprint(clipFromItem(look.tile, item),
                                             item.asWhole ? RenderScene::Impl::reachedBy(item) : item.mesh->bounds,
                                             noiseOf(look.tile, item)));
}

bool MaskedCuller::keepVisibleClusters(const Look& look, std::uint32_t index) {
    const SceneItem& item = look.scene.items[index];
    const std::vector<MeshCluster>& clusters = item.mesh->clusters();
    if (clusters.empty() || item.asWhole) return true;
    const Mat4d clip_T_item = clipFromItem(look.tile, item);
    const double noise = noiseOf(look.tile, item);
    const std::size_t first = hiddenClusters_.size();
    hiddenClusters_.resize(first + wordsFor(clusters.size()));
    std::size_t hidden = 0, shown = 0;
    const auto test = [&](std::size_t k) {
        work_.spentNs += CullingCosts::kTest;
        if (!buffer_.hides(look.tile.footprint(clip_T_item, clusters[k].box(), noise))) return false;
        hiddenClusters_[first + k / 64] |= std::uint64_t{1} << k % 64;
        ++hidden;
        return true;
    };
    // First those that would be drawn otherwise. The others are of interest only where none of these is left.
    choice_.shownParts(index, parts_);
    double savedNs = 0;
    for (const OccluderChoice::Part& part : parts_) {
        if (test(part.cluster))
            savedNs += part.facing * CullingCosts::kDrawnCluster;
        else
            ++shown;
    }
    if (shown > 0) {
        work_.savedNs += savedNs;
    } else {
        for (std::size_t k = 0, next = 0; k < clusters.size() && shown == 0; ++k) {
            if (next < parts_.size() && parts_[next].cluster == k)
                ++next;
            else
                shown += !test(k);
        }
    }
    if (hidden == 0) {
        hiddenClusters_.resize(first);
        return true;
    }
    hiddenFrom_[index] = static_cast<std::uint32_t>(first);
    return shown > 0;
}

}  // namespace tessera
