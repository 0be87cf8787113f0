#include "client/render/cull/PartView.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// What covers less, or so little by its triangles, hides too little for being drawn once more.
constexpr double kLeastPartOccluderPx = 256;
constexpr double kLeastPxPerTriangle = 8;

}  // namespace

PartView::PartView(const RenderScene::Impl& scene, const VisibilityDevice::Part& part)
    : scene_(scene),
      tile_(part.camera, part.pixels),
      frustum_(tileFrustum(part.camera, part.pixels, kFrustumMarginPx + scene.widestLineReachPx())),
      widestReachPx_(scene.widestLineReachPx()),
      reachBound_(scene.reaches.bound()),
      // Of (1 - z / w) / 2, where clip z is a z + b and w is -z.
      depthAtInfinity_(0.5 * (1 + part.camera.clip_T_eye(2, 2))),
      depthPerInverse_(-0.5 * part.camera.clip_T_eye(2, 3)) {}

BoxSight PartView::sightOf(Footprint footprint, double reachPx, Frustum::Mask undecided) const {
    BoxSight sight{.undecided = undecided};
    // Also what no number tells the place of.
    if (footprint.nearPlane || !(footprint.upperX - footprint.lowerX >= 0) ||
        !(footprint.upperY - footprint.lowerY >= 0)) {
        sight.fate = BoxSight::Fate::kTooNear;
        sight.nearest = std::numeric_limits<double>::infinity();
        return sight;
    }
    footprint.grow(reachPx);
    const auto within = [](double px, int size) {
        return static_cast<int>(std::clamp(px, 0.0, static_cast<double>(size)));
    };
    // Whole pixels: a plate's own edges are exact then.
    VisibilityDevice::Plate& plate = sight.plate;
    plate.left = within(std::floor(footprint.lowerX), tile_.widthPx());
    plate.right = within(std::ceil(footprint.upperX), tile_.widthPx());
    plate.bottom = within(std::floor(footprint.lowerY), tile_.heightPx());
    plate.top = within(std::ceil(footprint.upperY), tile_.heightPx());
    if (plate.left >= plate.right || plate.bottom >= plate.top) return sight;
    sight.fate = BoxSight::Fate::kAsk;
    sight.nearest = footprint.nearest;
    const auto depth = static_cast<float>(depthAtInfinity_ + depthPerInverse_ * footprint.nearest);
    plate.depth = std::clamp(std::nextafter(depth, 2.0f), 0.0f, 1.0f);
    return sight;
}

BoxSight PartView::node(std::uint32_t index, Frustum::Mask mask) const {
    const BoxTree::Node& node = scene_.tree.node(index);
    const Frustum::Result result = mask == 0 ? Frustum::Result{} : frustum_.classify(node.box, mask);
    if (result.outside) return {};
    return sightOf(tile_.footprint(tile_.clip_T_world(), node.box, tile_.noise(reachBound_, node.box)), widestReachPx_,
                   result.undecided);
}

BoxSight PartView::item(std::uint32_t index, Frustum::Mask mask) const {
    const Frustum::Result result = mask == 0 ? Frustum::Result{} : frustum_.classify(scene_.boxes[index], mask);
    if (result.outside) return {};
    const SceneItem& item = scene_.items[index];
    const Affine3d& world_T_item = item.world_T_item;
    return sightOf(tile_.footprint(tile_.clip_T_world() * world_T_item.matrix(),
                                   item.asWhole ? RenderScene::Impl::reachedBy(item) : item.mesh->bounds,
                                   tile_.noise(item.reach, world_T_item.translation())),
                   lineReachPx(item.lineWidth), result.undecided);
}

bool PartView::worthHidingWith(std::uint32_t index, const BoxSight& sight) const {
    const SceneItem& item = scene_.items[index];
    if (!item.occludes) return false;
    // What stands around the eye covers nobody knows how much.
    const double area = sight.fate == BoxSight::Fate::kTooNear ? areaPx() : sight.plate.areaPx();
    return area >= kLeastPartOccluderPx && area >= kLeastPxPerTriangle * static_cast<double>(item.mesh->triangles);
}

DrawItem PartView::drawItem(std::uint32_t index) const {
    DrawItem drawn;
    scene_.describe(index, drawn);
    return drawn;
}

}  // namespace tessera
