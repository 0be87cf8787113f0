#include "client/render/MaskedCuller.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// What this culler costs, and what drawing costs on two cores (measured; see README.md). Only their ratio matters, and
/// only for speed.
constexpr double kNsPerTriangle = 50;
constexpr double kNsPerPixel = 1.2;
constexpr double kNsPerOccluder = 500;
constexpr double kNsPerDrawnTriangle = 130;
constexpr double kNsPerDrawnItem = 2000;
/// Occluders may cost this share of what drawing everything in the frustum would.
constexpr double kShareOfDrawing = 0.08;
constexpr double kLeastBudgetNs = 200'000;
/// What covers less hides too little.
constexpr double kLeastOccluderPx = 400;
/// Meshes are made ready for hiding at most at this rate, so that a scene that has just been loaded does not make one
/// frame wait for all of them.
constexpr std::uint64_t kPreparedTrianglesPerFrame = 200'000;

double coveredPx(const Footprint& f, const TileProjection& tile) {
    if (f.nearPlane) return static_cast<double>(tile.widthPx()) * tile.heightPx();
    const double width = std::min<double>(f.upperX, tile.widthPx()) - std::max(f.lowerX, 0.0);
    const double height = std::min<double>(f.upperY, tile.heightPx()) - std::max(f.lowerY, 0.0);
    return width > 0 && height > 0 ? width * height : 0;
}

double noiseOf(const RenderScene::Impl& scene, const TileProjection& tile, const SceneItem& item) {
    return tile.noise(item.reach, scene.places[item.place].world_T_node.translation());
}

Mat4d clipFromItem(const RenderScene::Impl& scene, const TileProjection& tile, const SceneItem& item) {
    return tile.clip_T_world() * scene.places[item.place].world_T_node.matrix();
}

}  // namespace

void MaskedCuller::cull(const RenderScene::Impl& scene, const ScreenCamera& camera, const PixelRect& pixels,
                        std::vector<std::uint32_t>& items) {
    const TileProjection tile(camera, pixels);
    if (!tile.usable() || items.empty()) return;
    buffer_.reset(pixels.width, pixels.height);
    drawOccluders(scene, tile, items);
    keepVisible(scene, tile, tileFrustum(camera, pixels), items);
}

void MaskedCuller::drawOccluders(const RenderScene::Impl& scene, const TileProjection& tile,
                                 const std::vector<std::uint32_t>& items) {
    candidates_.clear();
    double drawingNs = 0;
    for (const std::uint32_t i : items) {
        const SceneItem& item = scene.items[i];
        drawingNs += kNsPerDrawnItem + kNsPerDrawnTriangle * static_cast<double>(item.mesh->triangles);
        if (!item.occludes || item.mesh->triangles > OccluderMesh::kMaxTriangles) continue;
        // Cheaper than a footprint, and enough for the many that are small.
        const double reach = scene.boxes[i].size().norm();
        const double w = tile.clip_T_world().row(3).dot(scene.boxes[i].center().homogeneous());
        const double reachPx = reach * tile.metresPerUnit() * tile.pixelsPerMetre();
        if (w > reach * tile.metresPerUnit() && reachPx * reachPx < kLeastOccluderPx * w * w) continue;
        const Footprint footprint =
            tile.footprint(clipFromItem(scene, tile, item), item.mesh->bounds, noiseOf(scene, tile, item));
        const double area = coveredPx(footprint, tile);
        if (area < kLeastOccluderPx) continue;
        const double cost =
            kNsPerOccluder + kNsPerTriangle * static_cast<double>(item.mesh->triangles) + kNsPerPixel * area;
        candidates_.push_back({i, cost, area / cost, footprint});
    }
    // Ties by item, so that the choice is the same on every run.
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
        return a.benefit != b.benefit ? a.benefit > b.benefit : a.item < b.item;
    });

    double budget = std::max(kLeastBudgetNs, kShareOfDrawing * drawingNs);
    std::uint64_t prepared = 0;
    for (std::size_t begin = 0; begin < candidates_.size() && budget > 0;) {
        // As many as the budget has room for, front to back: what is hidden by then costs nothing and leaves room for
        // more.
        std::size_t end = begin;
        for (double sum = 0; end < candidates_.size() && (end == begin || sum + candidates_[end].cost <= budget); ++end)
            sum += candidates_[end].cost;
        const auto batch = candidates_.begin();
        std::sort(batch + static_cast<std::ptrdiff_t>(begin), batch + static_cast<std::ptrdiff_t>(end),
                  [](const Candidate& a, const Candidate& b) {
                      if (a.footprint.nearPlane != b.footprint.nearPlane) return a.footprint.nearPlane;
                      return a.footprint.nearest != b.footprint.nearest ? a.footprint.nearest > b.footprint.nearest
                                                                        : a.item < b.item;
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
            rasteriser_.add(*mesh,
                            {.clip_T_mesh = clipFromItem(scene, tile, item),
                             .mirrored = item.mirrored,
                             .noise = noiseOf(scene, tile, item)},
                            tile, buffer_);
        }
    }
}

void MaskedCuller::keepVisible(const RenderScene::Impl& scene, const TileProjection& tile, const Frustum& frustum,
                               std::vector<std::uint32_t>& items) const {
    items.clear();
    const std::span<const BoxTree::Node> nodes = scene.tree.nodes();
    struct Open {
        std::uint32_t node;
        Frustum::Mask mask;
    };
    std::vector<Open> open{{0, Frustum::kAllPlanes}};
    while (!open.empty()) {
        const auto [index, mask] = open.back();
        open.pop_back();
        const BoxTree::Node& node = nodes[index];
        const Frustum::Result result = frustum.classify(node.box, mask);
        if (result.outside) continue;
        const double noise = tile.noise(scene.maxReach, node.box);
        if (buffer_.hides(tile.footprint(tile.clip_T_world(), node.box, noise))) continue;
        if (node.second != 0) {
            open.push_back({node.second, result.undecided});
            open.push_back({index + 1, result.undecided});
            continue;
        }
        for (const std::uint32_t i : scene.tree.itemsOf(node)) {
            if (frustum.classify(scene.boxes[i], result.undecided).outside) continue;
            const SceneItem& item = scene.items[i];
            const Footprint footprint =
                tile.footprint(clipFromItem(scene, tile, item), item.mesh->bounds, noiseOf(scene, tile, item));
            if (!buffer_.hides(footprint)) items.push_back(i);
        }
    }
}

}  // namespace tessera
